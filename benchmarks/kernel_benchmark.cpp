// Nanoseconds per pair of the kernel sums on one thread, for every vector target that this machine has: the counter
// `ns_per_pair` (printed in seconds, so n stands for nano) is the figure to compare.

#include <cmath>

#include <benchmark/benchmark.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include "pulson/core/parallel.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace {

using pulson::KernelOperator;
using pulson::KernelProfile;
using pulson::Points;

struct Problem {
  KernelOperator kernel;
  Points q, p, delta;
  Problem(KernelProfile profile, int d, int n)
      : kernel({{profile, 0.3, 1}}), q(Points::Random(d, n)), p(Points::Random(d, n)), delta(Points::Random(d, n)) {}
};

using Sum = Points (*)(const Problem&);

Points apply(const Problem& problem) { return problem.kernel.apply(problem.q, problem.q, problem.p); }
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

void add(const std::string& name, int64_t target, Sum sum, KernelProfile profile, int d, int n) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    pulson::set_thread_count(1);
    const Problem problem(profile, d, n);
    for (auto _ : state) benchmark::DoNotOptimize(sum(problem));
    state.counters["ns_per_pair"] =
        benchmark::Counter(1.0 * n * n, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  });
}

void add_sums(int64_t target, KernelProfile profile, int d, int n) {
  const std::string setting = std::string(profile == KernelProfile::kGaussian ? "gaussian" : "peakon") +
                              "/d:" + std::to_string(d) + "/N:" + std::to_string(n) + "/" +
                              hwy::TargetName(static_cast<uint32_t>(target));
  add("apply/" + setting, target, apply, profile, d, n);
  add("apply_tangent/" + setting, target, apply_tangent, profile, d, n);
  add("gradient/" + setting, target, gradient, profile, d, n);
  add("hessian/" + setting, target, hessian, profile, d, n);
}

}  // namespace

int main(int argc, char** argv) {
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    add_sums(target, KernelProfile::kGaussian, 2, 1000);
    add_sums(target, KernelProfile::kPeakon, 2, 1000);
  }
  for (const int d : {1, 3}) add_sums(hwy::SupportedAndGeneratedTargets().front(), KernelProfile::kGaussian, d, 1000);
  for (const int n : {2, 10, 100})
    add_sums(hwy::SupportedAndGeneratedTargets().front(), KernelProfile::kGaussian, 2, n);
  add("apply/gaussian/d:2/N:1000/std_exp", hwy::SupportedAndGeneratedTargets().front(), apply_scalar,
      KernelProfile::kGaussian, 2, 1000);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
