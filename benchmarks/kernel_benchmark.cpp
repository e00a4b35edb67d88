// Nanoseconds per pair of the kernel sums on one thread, for every vector target that this machine has: the counter
// `ns_per_pair` (printed in seconds, so n stands for nano) is the figure to compare.

#include <cmath>
#include <string>

#include <benchmark/benchmark.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include "pulson/core/parallel.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace {

using pulson::KernelOperator;
using pulson::Points;

struct Problem {
  KernelOperator kernel;
  Points q, p, delta;
  Problem(const std::string& name, int d, int n)
      : kernel(pulson::make_kernel(name + ":alpha=0.3", Points())),
        q(Points::Random(d, n)),
        p(Points::Random(d, n)),
        delta(Points::Random(d, n)) {}
};

using Sum = Points (*)(const Problem&);

Points apply(const Problem& problem) { return problem.kernel.apply(problem.q, problem.q, problem.p); }
Points apply_with_jacobian(const Problem& problem) {
  Eigen::MatrixXd jacobian;
  return problem.kernel.apply_with_jacobian(problem.q, problem.q, problem.p, jacobian);
}
Points apply_tangent(const Problem& problem) {
  return problem.kernel.apply_tangent(problem.q, problem.p, problem.delta);
}
Points gradient(const Problem& problem) { return problem.kernel.gradient(problem.q, problem.p, problem.p); }
Points hessian(const Problem& problem) { return problem.kernel.hessian(problem.q, problem.p, problem.delta); }

// The yardstick: std::exp, one pair at a time.
Points apply_scalar(const Problem& problem) {
  const Eigen::Index n = problem.q.cols();
  Points u = Points::Zero(2, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const double x = problem.q(0, i) - problem.q(0, j);
      const double y = problem.q(1, i) - problem.q(1, j);
      const double k = std::exp((x * x + y * y) * (-1 / (0.3 * 0.3)));
      u(0, i) += k * problem.p(0, j);
      u(1, i) += k * problem.p(1, j);
    }
  return u;
}

void add(const std::string& name, int64_t target, Sum sum, const std::string& kernel, int d, int n) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    pulson::set_thread_count(1);
    const Problem problem(kernel, d, n);
    for (auto _ : state) benchmark::DoNotOptimize(sum(problem));
    state.counters["ns_per_pair"] =
        benchmark::Counter(1.0 * n * n, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  });
}

void add_sums(int64_t target, const std::string& kernel, int d, int n) {
  const std::string setting = kernel + "/d:" + std::to_string(d) + "/N:" + std::to_string(n) + "/" +
                              hwy::TargetName(static_cast<uint32_t>(target));
  add("apply/" + setting, target, apply, kernel, d, n);
  add("apply_with_jacobian/" + setting, target, apply_with_jacobian, kernel, d, n);
  add("apply_tangent/" + setting, target, apply_tangent, kernel, d, n);
  add("gradient/" + setting, target, gradient, kernel, d, n);
  add("hessian/" + setting, target, hessian, kernel, d, n);
}

}  // namespace

int main(int argc, char** argv) {
  const auto& kernels = pulson::kernel_table().rows();
  for (const int64_t target : hwy::SupportedAndGeneratedTargets())
    for (const auto& kernel : kernels) add_sums(target, kernel.name, 2, 1000);
  const int64_t best = hwy::SupportedAndGeneratedTargets().front();
  for (const int d : {1, 3})
    for (const auto& kernel : kernels) add_sums(best, kernel.name, d, 1000);
  for (const int n : {2, 10, 100}) add_sums(best, "gaussian", 2, n);
  add("apply/gaussian/d:2/N:1000/std_exp", best, apply_scalar, "gaussian", 2, 1000);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
