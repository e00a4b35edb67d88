// Nanoseconds per step of a path in the vector lanes of ensembles on one thread, for every vector target that this
// machine has. Counters are printed in seconds, so n stands for nano: `per_step` of one path; `per_pair` is that over
// the N(N − 1)/2 pairs of landmarks and `per_square` that over N², to compare with ns_per_pair of kernel_benchmark.

#include <cmath>
#include <cstdint>
#include <string>

#include <benchmark/benchmark.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include "../src/ensemble/landmark_lanes.hpp"
#include "../src/ensemble/pair_lanes.hpp"
#include "pulson/noise/noise_table.hpp"

namespace {

using pulson::Points;
using pulson::ensemble::kPathBatch;

void use_target(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().DeInit();
}

void count(benchmark::State& state, const std::string& name, double per_iteration) {
  state.counters[name] =
      benchmark::Counter(per_iteration, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// Landmarks on a circle of diameter 4 widths that bends and moves by a width, at most, in time 1.
pulson::PhaseState circle(const pulson::KernelOperator& kernel, int landmarks) {
  pulson::PhaseState state{Points(2, landmarks), Points(2, landmarks)};
  for (int a = 0; a < landmarks; ++a) {
    const double angle = 2 * M_PI * a / landmarks;
    state.q.col(a) << 2 * std::cos(angle), 2 * std::sin(angle);
    state.p.col(a) << 1 + std::cos(2 * angle), std::sin(3 * angle);
  }
  state.p /= kernel.apply(state.q, state.q, state.p).colwise().norm().maxCoeff();
  return state;
}

void add_landmarks(std::int64_t target, const std::string& kernel, int landmarks) {
  const std::string name =
      "landmarks/" + kernel + "/d:2/N:" + std::to_string(landmarks) + "/" + hwy::TargetName(target);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    use_target(target);
    constexpr int kSteps = 50;
    const pulson::StochasticSystem system{pulson::make_kernel(kernel + ":alpha=1", {}),
                                          pulson::make_noise("ch-sd:beta=0.1")};
    const pulson::ensemble::LandmarkModel model(system, 2, landmarks, 1.0 / kSteps, 1);
    const pulson::ensemble::LandmarkBatch start =
        pulson::ensemble::landmark_batch(model.channels, 0, circle(system.kernel, landmarks));
    for (auto _ : state) {
      pulson::ensemble::LandmarkBatch batch = start;
      pulson::ensemble::advance_landmarks(model, batch, 0, kSteps);
      benchmark::DoNotOptimize(batch.q.data());
    }
    const double steps = static_cast<double>(pulson::ensemble::kPathBatch) * kSteps;
    count(state, "per_step", steps);
    count(state, "per_pair", steps * 0.5 * landmarks * (landmarks - 1));
    count(state, "per_square", steps * landmarks * landmarks);
  });
}

// The crossing pair of the paper's section 5.
void add_pair(std::int64_t target, const std::string& kernel) {
  const std::string name = "pair/" + kernel + "/" + hwy::TargetName(target);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    use_target(target);
    pulson::ensemble::PairModel model(pulson::make_kernel(kernel + ":alpha=1", {}).terms().front());
    model.channels = 1;
    model.position[0] = {0, 1.5};
    constexpr std::uint32_t kSteps = 5000;
    for (auto _ : state) {
      pulson::ensemble::PairBatch batch = pulson::ensemble::pair_batch(model, 0, 0, 10, 4, 1);
      pulson::ensemble::advance_pair(model, batch, 0, kSteps);
      benchmark::DoNotOptimize(batch.gap.data());
    }
    count(state, "per_step", static_cast<double>(pulson::ensemble::kPathBatch) * kSteps);
  });
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
  for (const std::int64_t target : targets)
    for (const std::string kernel : {"gaussian", "peakon"}) add_pair(target, kernel);
  for (const std::int64_t target : targets)
    for (const int landmarks : {2, 10, 50, 200}) add_landmarks(target, "gaussian", landmarks);
  for (const std::string kernel : {"peakon", "matern32", "matern52"}) add_landmarks(targets.front(), kernel, 50);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
