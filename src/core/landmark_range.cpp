#include "landmark_range.hpp"

#include <vector>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

constexpr double kLargestCoordinate = 1e100;
constexpr double kSmallestSize = 1e-100;

}  // namespace

void require_usable_range(const Landmarks& shape) {
  std::vector<int> complete;
  for (int a = 0; a < shape.count(); ++a)
    if (!shape.points.col(a).array().isNaN().any()) complete.push_back(a);
  if (complete.empty()) throw InputError(fmt::format("{}: no landmark has all its coordinates", shape.source));
  const Points points = shape.points(Eigen::all, complete);
  const double largest = points.cwiseAbs().maxCoeff();
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
  if (!(largest <= kLargestCoordinate))
    throw InputError(fmt::format("{}: a coordinate is {}; at most {} in size is supported, change the unit",
                                 shape.source, largest, kLargestCoordinate));
  if (size > 0 && size < kSmallestSize)
    throw InputError(fmt::format("{}: the shape is {} across; at least {} is supported, change the unit", shape.source,
                                 size, kSmallestSize));
}

}  // namespace pulson
