// Seconds to rasterise a deformed pixel mesh of the given width, square, with S×S samples per pixel: `mild` shifts
// places by up to 5 pixels, `folded` by up to 0.3 widths, where samples have up to 19 preimages. On one thread and on
// all.

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "pulson/core/parallel.hpp"
#include "warp/mesh_raster.hpp"

namespace {

pulson::warp::DeformedMesh wavy_mesh(int width, double amplitude) {
  pulson::warp::DeformedMesh mesh{width + 1, width + 1, {}};
  const double k = 20.0 / width;
  for (int row = 0; row <= width; ++row)
    for (int column = 0; column <= width; ++column) {
      const double x = column - 0.5;
      const double y = row - 0.5;
      mesh.vertices.push_back({static_cast<float>(x + amplitude * std::sin(k * (y + 0.3 * x))),
                               static_cast<float>(y + amplitude * std::sin(k * x))});
    }
  return mesh;
}

void raster(benchmark::State& state, double amplitude, int threads) {
  const int width = static_cast<int>(state.range(0));
  const int supersampling = static_cast<int>(state.range(1));
  const pulson::warp::DeformedMesh mesh = wavy_mesh(width, amplitude);
  pulson::set_thread_count(threads);
  for (auto _ : state) {
    const pulson::warp::MeshRaster raster(mesh, {width, width, supersampling});
    std::vector<pulson::warp::Coverage> coverage(static_cast<std::size_t>(raster.bands()));
    pulson::parallel_for(raster.bands(), [&](int band) {
      coverage[static_cast<std::size_t>(band)] = pulson::warp::coverage(raster.band(band));
    });
    benchmark::DoNotOptimize(coverage.data());
  }
  pulson::set_thread_count(0);
  state.counters["megasamples_per_s"] = benchmark::Counter(1e-6 * width * width * supersampling * supersampling,
                                                           benchmark::Counter::kIsIterationInvariantRate);
}

void add(const std::string& name, double amplitude, int threads) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { raster(state, amplitude, threads); })
      ->ArgNames({"width", "S"})
      ->ArgsProduct({{1000}, {1, 2, 4}})
      ->MeasureProcessCPUTime()
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [threads, on] : {std::pair{1, "one"}, std::pair{0, "all"}}) {
    add(std::string("mild/threads:") + on, 5, threads);
    add(std::string("folded/threads:") + on, 300, threads);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
