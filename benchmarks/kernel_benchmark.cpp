// Nanoseconds per pair of the kernel sums, one thread; the counter `ns_per_pair` is the figure to compare.
// HWY_DISABLED_TARGETS cannot be set at run time: the vector target is the best that the machine has, and is printed.

#include <cmath>

#include <benchmark/benchmark.h>

#include "pulson/core/parallel.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace {

using pulson::KernelOperator;
using pulson::KernelProfile;
using pulson::Points;

struct Problem {
  explicit Problem(const benchmark::State& state)
      : kernel({{static_cast<KernelProfile>(state.range(0)), 0.3, 1}}),
        q(Points::Random(state.range(1), state.range(2))),
        p(Points::Random(state.range(1), state.range(2))),
        delta(Points::Random(state.range(1), state.range(2))) {
    pulson::set_thread_count(1);
  }
  KernelOperator kernel;
  Points q, p, delta;
};

void report(benchmark::State& state) {
  const double pairs = static_cast<double>(state.range(2)) * static_cast<double>(state.range(2));
  state.counters["ns_per_pair"] =
      benchmark::Counter(pairs * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.SetLabel(pulson::vector_target());
}

void apply(benchmark::State& state) {
  const Problem problem(state);
  for (auto _ : state) benchmark::DoNotOptimize(problem.kernel.apply(problem.q, problem.q, problem.p));
  report(state);
}

void apply_tangent(benchmark::State& state) {
  const Problem problem(state);
  for (auto _ : state) benchmark::DoNotOptimize(problem.kernel.apply_tangent(problem.q, problem.p, problem.delta));
  report(state);
}

void gradient(benchmark::State& state) {
  const Problem problem(state);
  for (auto _ : state) benchmark::DoNotOptimize(problem.kernel.gradient(problem.q, problem.p, problem.p));
  report(state);
}

void hessian(benchmark::State& state) {
  const Problem problem(state);
  for (auto _ : state) benchmark::DoNotOptimize(problem.kernel.hessian(problem.q, problem.p, problem.delta));
  report(state);
}

// The yardstick: the same sum with std::exp, one pair at a time.
void apply_scalar_exp(benchmark::State& state) {
  const Problem problem(state);
  const Eigen::Index n = problem.q.cols();
  Points u(problem.q.rows(), n);
  for (auto _ : state) {
    u.setZero();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        u.col(i) +=
            std::exp((problem.q.col(i) - problem.q.col(j)).squaredNorm() * (-1 / (0.3 * 0.3))) * problem.p.col(j);
    benchmark::DoNotOptimize(u.data());
  }
  report(state);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"kernel", "d", "N"});
  benchmark->Args({0, 2, 1000});
  for (const int kernel : {0, 1})
    for (const int d : {1, 2, 3})
      for (const int n : {10, 100, 1000})
        if (kernel != 0 || d != 2 || n != 1000) benchmark->Args({kernel, d, n});
}

BENCHMARK(apply)->Apply(sizes);
BENCHMARK(apply_tangent)->Apply(sizes);
BENCHMARK(gradient)->Apply(sizes);
BENCHMARK(hessian)->Apply(sizes);
BENCHMARK(apply_scalar_exp)->ArgNames({"kernel", "d", "N"})->Args({0, 2, 1000});

}  // namespace
