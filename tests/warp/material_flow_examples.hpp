#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/Core>

#include "kernel_definition.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson::warp {

/// A system and a path of its landmarks.
struct Motion {
  StochasticSystem system;
  Trajectory path;

  MaterialFlow flow(LabelKernel labels = LabelKernel::kMetric) const { return {system, path, labels}; }
};

inline Motion move(const std::string& integrator, const StochasticSystem& system, const PhaseState& initial,
                   const TimeGrid& grid, const Eigen::MatrixXd& increments) {
  return {system, make_integrator(integrator)->integrate(system, initial, grid, increments)};
}

// Seven landmarks about half a unit apart, in every dimension.
inline Points spread_landmarks(int dimension) {
  Points q = 0.1 * random_points(dimension, 7, 5);
  for (int a = 0; a < 7; ++a) {
    q(0, a) += dimension == 1 ? 0.5 * a : 0.8 * std::cos(a * 2 * std::numbers::pi / 7);
    if (dimension > 1) q(1, a) += 0.8 * std::sin(a * 2 * std::numbers::pi / 7);
  }
  return q;
}

/// The seven landmarks from random momenta for which the first step has κ = 0.1; peakons that run into each other end
/// in a collision.
inline Motion random_motion(const std::string& integrator, const KernelOperator& kernel, const std::string& noise,
                            int dimension, TimeGrid grid = {1, 20}) {
  Landmarks shape;
  shape.points = spread_landmarks(dimension);
  const StochasticSystem system{kernel, make_noise(noise, shape)};
  const Points p0 = random_points(dimension, 7, 2);
  const double kappa = contraction_bound(kernel, p0, grid.dt());
  const int channels = system.noise->channels(dimension, 7);
  return move(integrator, system, {shape.points, 0.1 / kappa * p0}, grid,
              std::sqrt(grid.dt()) * random_points(channels, grid.steps, 9));
}

}  // namespace pulson::warp
