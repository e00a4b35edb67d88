// Seconds to map every pixel of a square image of the given width by the flow of 100 landmarks in 20 steps, at a
// tolerance of 0.05 pixels, and by a map that costs nothing: that is interpolation alone. On one thread and on all.

#include <cmath>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "pulson/core/parallel.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace {

using pulson::Points;

constexpr double kTolerance = 0.05;

// Landmarks on a spiral over the image, of which the kernel is a fifth as wide, that move by about a tenth of it.
pulson::warp::MaterialFlow flow_over(int width) {
  constexpr int kLandmarks = 100;
  pulson::PhaseState state{Points(2, kLandmarks), Points(2, kLandmarks)};
  for (int a = 0; a < kLandmarks; ++a) {
    const double radius = 0.45 * width * std::sqrt((a + 0.5) / kLandmarks);
    state.q.col(a) << 0.5 * width + radius * std::cos(2.4 * a), 0.5 * width + radius * std::sin(2.4 * a);
    state.p.col(a) << std::sin(5 * state.q(1, a) / width), std::cos(4 * state.q(0, a) / width);
  }
  const pulson::StochasticSystem system{pulson::make_kernel("gaussian:alpha=" + std::to_string(0.2 * width), {}),
                                        pulson::make_noise("none")};
  state.p *= 0.1 * width / system.kernel.apply(state.q, state.q, state.p).colwise().norm().maxCoeff();
  return {system, pulson::make_integrator("variational")->integrate(system, state, {1, 20}, Eigen::MatrixXd(0, 20))};
}

pulson::warp::MovedPoints free_map(const Points& points) {
  const Eigen::Vector4d gradient(1, 0, 0, 1);
  return {points, gradient.replicate(1, points.cols())};
}

void sample(benchmark::State& state, const pulson::warp::PlaneMap& map, int threads) {
  const int width = static_cast<int>(state.range(0));
  pulson::set_thread_count(threads);
  pulson::warp::SampledMap sampled;
  for (auto _ : state) {
    sampled = pulson::warp::sample_map(map, {width, width, 0}, kTolerance, state.range(1) != 0);
    benchmark::DoNotOptimize(sampled.places.data());
  }
  pulson::set_thread_count(0);
  state.counters["exact_per_cent"] = 100 * sampled.exact_fraction;
  state.counters["error"] = sampled.error;
  state.counters["jacobian_error"] = sampled.jacobian_error;
}

template <class Run>
void add(const std::string& name, const Run& run) {
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->ArgNames({"width", "jacobians"})
      ->ArgsProduct({{1000, 4000}, {0, 1}})
      ->MeasureProcessCPUTime()
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [threads, on] : {std::pair{1, "one"}, std::pair{0, "all"}}) {
    add(std::string("interpolation/threads:") + on,
        [threads = threads](benchmark::State& state) { sample(state, free_map, threads); });
    add(std::string("flow/threads:") + on, [threads = threads](benchmark::State& state) {
      const pulson::warp::MaterialFlow flow = flow_over(static_cast<int>(state.range(0)));
      sample(
          state, [&](const Points& points) { return flow.end_with_gradients(points); }, threads);
    });
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
