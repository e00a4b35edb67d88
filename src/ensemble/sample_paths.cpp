#include <algorithm>

#include <fmt/core.h>

#include "core/number_checks.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson {
namespace {

// The path as far as it goes: its first `steps` steps, which have been taken before.
Trajectory beginning(const StochasticSystem& system, const Integrator& integrator, const PhaseState& start,
                     const TimeGrid& grid, const Eigen::MatrixXd& increments, int steps) {
  for (; steps > 0; --steps) {
    try {
      return integrator.integrate(system, start, {steps * grid.dt(), steps}, increments.leftCols(steps));
    } catch (const StepError&) {  // the last bit of Δt decided
    }
  }
  Trajectory path;
  path.integrator = integrator.name();
  path.grid = {0, 0};
  path.increments = increments.leftCols(0);
  path.states.push_back(start);
  return path;
}

void measure(SamplePath& sample, double bound) {
  const PhaseState& start = sample.path.initial();
  const Eigen::VectorXd total = start.p.rowwise().sum();
  const double size = start.p.colwise().norm().sum();
  for (std::size_t k = 0; k < sample.path.states.size(); ++k) {
    const Points& p = sample.path.states[k].p;
    const double largest = p.colwise().norm().maxCoeff();
    sample.largest_momentum = std::max(sample.largest_momentum, largest);
    sample.momentum_error = std::max(sample.momentum_error, (p.rowwise().sum() - total).norm() / (size > 0 ? size : 1));
    if (largest > bound && sample.status != PathStatus::kMomentumBound) {
      sample.status = PathStatus::kMomentumBound;
      sample.reason =
          fmt::format("a momentum passed {:.3g} at t = {:.4g}", bound, sample.path.grid.at(static_cast<int>(k)));
    }
  }
}

}  // namespace

std::string path_status_name(PathStatus status) {
  if (status == PathStatus::kClean) return "clean";
  return status == PathStatus::kNoRoot ? "no_root" : "momentum_bound";
}

SamplePath sample_path(const StochasticSystem& system, const Integrator& integrator, const PhaseState& start,
                       const TimeGrid& grid, const Eigen::MatrixXd& increments, double momentum_bound) {
  SamplePath sample;
  try {
    sample.path = integrator.integrate(system, start, grid, increments);
  } catch (const StepError& error) {
    sample.status = PathStatus::kNoRoot;
    sample.reason = error.what();
    sample.path = beginning(system, integrator, start, grid, increments, error.step());
  }
  measure(sample, momentum_bound);
  return sample;
}

std::vector<SamplePath> sample_paths(const StochasticSystem& system, const Integrator& integrator,
                                     const PhaseState& start, const SamplePathsOptions& options) {
  const auto d = static_cast<int>(start.q.rows());
  const auto n = static_cast<int>(start.q.cols());
  require_size("the momenta at the start", start.p, d, n);
  system.noise->check(d, n);
  const int channels = system.noise->channels(d, n);
  std::vector<SamplePath> samples(static_cast<std::size_t>(options.samples));
  parallel_for(options.samples, [&](int m) {
    SamplePath& sample = samples[static_cast<std::size_t>(m)];
    sample = sample_path(system, integrator, start, options.grid,
                         brownian_increments(options.seed, static_cast<std::uint64_t>(m), channels, options.grid),
                         options.momentum_bound);
    sample.contraction_bound = contraction_bound(system.kernel, sample.path);
  });
  return samples;
}

}  // namespace pulson
