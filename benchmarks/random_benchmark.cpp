// Nanoseconds per normal number on one thread, for every vector target that this machine has: the counter
// `ns_per_normal` (printed in seconds, so n stands for nano) is the figure to compare.

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include "random/normals.hpp"

namespace {

void count_normals(benchmark::State& state, double per_iteration) {
  state.counters["ns_per_normal"] =
      benchmark::Counter(per_iteration, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void use_target(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().DeInit();
}

void add_batch(std::int64_t target, std::size_t paths) {
  const std::string name = "batch/paths:" + std::to_string(paths) + "/" + hwy::TargetName(target);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    use_target(target);
    std::vector<double> normals(4 * paths);
    std::uint32_t block = 0;
    for (auto _ : state) {
      pulson::fill_standard_normals(1, 0, paths, block++ & 0xFFFFU, 0, normals.data());
      benchmark::DoNotOptimize(normals.data());
      benchmark::ClobberMemory();
    }
    count_normals(state, 4.0 * static_cast<double>(paths));
  });
}

void add_single_path(std::int64_t target, int channels, int steps) {
  const std::string name =
      "path/channels:" + std::to_string(channels) + "/steps:" + std::to_string(steps) + "/" + hwy::TargetName(target);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    use_target(target);
    std::uint64_t path = 0;
    for (auto _ : state) benchmark::DoNotOptimize(pulson::standard_normals(1, path++, channels, steps));
    count_normals(state, 1.0 * channels * steps);
  });
}

// The yardstick.
void standard_library(benchmark::State& state) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (auto _ : state) benchmark::DoNotOptimize(normal(generator));
  count_normals(state, 1);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
  for (const std::int64_t target : targets) add_batch(target, 1024);
  for (const std::size_t paths : {1U, 8U, 100'000U}) add_batch(targets.front(), paths);
  for (const int channels : {2, 100}) add_single_path(targets.front(), channels, 100);
  benchmark::RegisterBenchmark("std::normal_distribution/mt19937_64", standard_library);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
