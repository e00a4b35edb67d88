#pragma once

#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::warp {

/// A regular grid in R^d with equal distances along all axes: the coordinates of its points along each axis.
using SpaceGrid = std::vector<Eigen::VectorXd>;

/// All points of a grid, d×M, the last axis fastest.
Points grid_points(const SpaceGrid& grid);

/// A grid over the box of all landmarks of a path and a margin, in which the field decays: the width of the kernel,
/// but at least 12 % and at most 50 % of the longest side. @param count of points along the longest axis, at least 2
SpaceGrid grid_around(const KernelOperator& kernel, const Trajectory& path, int count);

/// u(x, t_k) = Σ_b K(x − q_b(t_k)) p_b(t_k), (2), from the states (q, p) of a path.
struct VelocityField {
  SpaceGrid grid;
  std::vector<int> steps;          ///< of the path
  std::vector<double> times;       ///< t_k of these steps
  std::vector<Points> velocities;  ///< for each, d×M in the order of grid_points()

  /// [time][component][…grid], the last axis fastest.
  std::vector<double> numbers() const;
};

/// What moves space is u alone where the path has no noise. The fields of noise, Σ_i ξ_i ∘ dW_i of P-SD, are not in it.
/// O(KMN); runs on all threads.
VelocityField velocity_field(const KernelOperator& kernel, const Trajectory& path, const SpaceGrid& grid,
                             const std::vector<int>& steps);

}  // namespace pulson::warp
