#include "space_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/fields/grid_fields.hpp"

namespace pulson {
namespace {

constexpr int kUsualGridPoints = 41;  // along the longest side
constexpr int kMostGridPoints = 512;
constexpr double kMargin = 0.25;  // of the longest side of the landmarks' box, on each side

// LPS from RAS, or back: x and y point the other way.
Eigen::Array3d lps_signs(const std::string& axes) {
  return axes == "RAS" ? Eigen::Array3d(-1, -1, 1) : Eigen::Array3d(1, 1, 1);
}

class SpaceMap {
 public:
  SpaceMap(const warp::MaterialFlow& flow, const matching::Registration& registration, bool to_target)
      : flow_(flow),
        alignment_(registration.alignment),
        to_target_(to_target),
        signs_(lps_signs(registration.target.axes)) {}

  // Displacements of points in the axes of the file, 3×M.
  Points displacements(const Points& places) const {
    const Points own = turned(places);
    return turned((to_target_ ? flow_.end(alignment_.apply(own)) : before(own)) - own);
  }

  Points turned(const Points& places) const { return (places.array().colwise() * signs_).matrix(); }

 private:
  Points before(const Points& places) const {
    return (alignment_.scale * alignment_.linear).inverse() *
           (flow_.inverse(places).places.colwise() - alignment_.translation);
  }

  const warp::MaterialFlow& flow_;
  const Alignment& alignment_;
  bool to_target_;
  Eigen::Array3d signs_;
};

fields::GridField grid_about(const Points& places, int count) {
  const auto [low, high] = bounding_box(places);
  const double side = (high - low).maxCoeff();
  if (!(side > 0)) throw InputError("--field: the landmarks lie at one place, which is no box for a grid");
  const double spacing = (1 + 2 * kMargin) * side / (count - 1);
  fields::GridField grid;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double length = high[axis] - low[axis] + 2 * kMargin * side;
    const int size = std::max(2, static_cast<int>(std::ceil(length / spacing * (1 - 1e-9))) + 1);
    grid.sizes.push_back(size);
    grid.spacing.push_back(spacing);
    grid.origin.push_back((low[axis] + high[axis]) / 2 - spacing * (size - 1) / 2);
  }
  grid.components = 3;
  return grid;
}

Points points_of_slice(const fields::GridField& grid, int z) {
  Points points(3, static_cast<Eigen::Index>(grid.sizes[0]) * grid.sizes[1]);
  Eigen::Index at = 0;
  for (int y = 0; y < grid.sizes[1]; ++y)
    for (int x = 0; x < grid.sizes[0]; ++x, ++at)
      points.col(at) << grid.origin[0] + x * grid.spacing[0], grid.origin[1] + y * grid.spacing[1],
          grid.origin[2] + z * grid.spacing[2];
  return points;
}

// Trilinear, as those who read the file interpolate.
Eigen::Vector3d interpolated(const fields::GridField& grid, const Eigen::Vector3d& place) {
  std::array<int, 3> cell{};
  std::array<double, 3> part{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = (place[static_cast<Eigen::Index>(axis)] - grid.origin[axis]) / grid.spacing[axis];
    cell[axis] = std::clamp(static_cast<int>(std::floor(at)), 0, grid.sizes[axis] - 2);
    part[axis] = at - cell[axis];
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> step{corner & 1, corner >> 1 & 1, corner >> 2};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) weight *= step[axis] == 1 ? part[axis] : 1 - part[axis];
    const auto index = (static_cast<std::size_t>(cell[2] + step[2]) * static_cast<std::size_t>(grid.sizes[1]) +
                        static_cast<std::size_t>(cell[1] + step[1])) *
                           static_cast<std::size_t>(grid.sizes[0]) +
                       static_cast<std::size_t>(cell[0] + step[0]);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      sum[axis] += weight * static_cast<double>(grid.values[3 * index + static_cast<std::size_t>(axis)]);
  }
  return sum;
}

}  // namespace

void check_space_field(const WarpArguments& arguments, const warp::MaterialFlow& flow) {
  if (arguments.field.empty()) return;
  if (flow.dimension() != 3)
    throw InputError(
        fmt::format("--field of landmarks is one in 3D, and they are in {}D: in the plane give the image "
                    "whose pixels it is of in place of {}",
                    flow.dimension(), arguments.input));
  const int count = arguments.grid_points.value_or(kUsualGridPoints);
  if (count < 2 || count > kMostGridPoints)
    throw InputError(fmt::format("--grid-points is {}; it must be from 2 to {}", count, kMostGridPoints));
  if (!flow.is_diffeomorphic())
    throw InputError(
        "--field leads back from the target, which needs a map that has an inverse; here the noise moves landmarks "
        "individually: register with --noise none, or with noise that is a field, such as p-sd");
}

std::string write_space_field(const WarpArguments& arguments, const warp::MaterialFlow& flow,
                              const matching::Registration& registration) {
  const SpaceMap map(flow, registration, arguments.inverse);
  const Points landmarks = map.turned(arguments.inverse ? registration.original.points : registration.result);
  fields::GridField grid = grid_about(landmarks, arguments.grid_points.value_or(kUsualGridPoints));
  for (int z = 0; z < grid.sizes[2]; ++z) {
    const Points moved = map.displacements(points_of_slice(grid, z));
    if (!moved.allFinite())
      throw NumericalError(fmt::format("{}: a point is moved out of the range of numbers", arguments.field));
    for (const double value : moved.reshaped()) grid.values.push_back(static_cast<float>(value));
  }
  fields::write_grid_field(arguments.field, grid);
  const Points exact = map.displacements(landmarks);
  double error = 0;
  for (Eigen::Index a = 0; a < landmarks.cols(); ++a)
    error = std::max(error, (interpolated(grid, landmarks.col(a)) - exact.col(a)).norm());
  return fmt::format("field      {} points, {:.4g} apart, {}: between them, at the landmarks, off by up to {:.2g}",
                     fmt::join(grid.sizes, " x "), grid.spacing[0],
                     arguments.inverse ? "from source to target" : "from target to source", error);
}

}  // namespace pulson
