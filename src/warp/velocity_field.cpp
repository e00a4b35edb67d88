#include "pulson/warp/velocity_field.hpp"

#include <algorithm>
#include <cmath>

#include "pulson/core/errors.hpp"

namespace pulson::warp {
namespace {

constexpr double kLeastMargin = 0.12, kMostMargin = 0.5;  // of the longest side

std::pair<Eigen::VectorXd, Eigen::VectorXd> box_of(const Trajectory& path) {
  auto [low, high] = bounding_box(path.initial().q);
  for (const PhaseState& state : path.states) {
    const auto [from, to] = bounding_box(state.q);
    low = low.cwiseMin(from);
    high = high.cwiseMax(to);
  }
  return {low, high};
}

double margin_of(const KernelOperator& kernel, double side) {
  double width = 0;
  for (const KernelTerm& term : kernel.terms()) width = std::max(width, term.alpha);
  return side > 0 ? std::clamp(width, kLeastMargin * side, kMostMargin * side) : width;
}

}  // namespace

Points grid_points(const SpaceGrid& grid) {
  Eigen::Index count = 1;
  for (const Eigen::VectorXd& axis : grid) count *= axis.size();
  const auto d = static_cast<Eigen::Index>(grid.size());
  Points points(d, count);
  Eigen::Index stride = count;  // of points that share a coordinate
  for (Eigen::Index i = 0; i < d; ++i) {
    const Eigen::VectorXd& axis = grid[static_cast<std::size_t>(i)];
    stride /= axis.size();
    for (Eigen::Index m = 0; m < count; ++m) points(i, m) = axis[m / stride % axis.size()];
  }
  return points;
}

SpaceGrid grid_around(const KernelOperator& kernel, const Trajectory& path, int count) {
  if (count < 2) throw InputError("a grid of " + std::to_string(count) + " points: at least 2 are needed");
  const auto [low, high] = box_of(path);
  const double side = (high - low).maxCoeff(), margin = margin_of(kernel, side);
  const double spacing = (side + 2 * margin) / (count - 1);
  SpaceGrid grid;
  for (Eigen::Index i = 0; i < low.size(); ++i) {
    const double span = high[i] - low[i] + 2 * margin;
    const auto points = static_cast<Eigen::Index>(std::lround(span / spacing)) + 1;
    const double first = low[i] - margin + (span - spacing * static_cast<double>(points - 1)) / 2;
    grid.emplace_back(Eigen::VectorXd::LinSpaced(points, first, first + spacing * static_cast<double>(points - 1)));
  }
  return grid;
}

std::vector<double> VelocityField::numbers() const {
  std::vector<double> all;
  for (const Points& velocity : velocities)
    for (const auto component : velocity.rowwise()) all.insert(all.end(), component.begin(), component.end());
  return all;
}

VelocityField velocity_field(const KernelOperator& kernel, const Trajectory& path, const SpaceGrid& grid,
                             const std::vector<int>& steps) {
  VelocityField field{grid, steps, {}, {}};
  const Points points = grid_points(grid);
  for (const int k : steps) {
    const PhaseState& state = path.states.at(static_cast<std::size_t>(k));
    field.times.push_back(path.grid.at(k));
    field.velocities.push_back(kernel.apply(points, state.q, state.p));
  }
  return field;
}

}  // namespace pulson::warp
