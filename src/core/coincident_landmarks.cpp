#include "core/coincident_landmarks.hpp"

#include <fmt/core.h>

#include "core/landmark_pairs.hpp"

namespace pulson {

bool is_repeated(const Points& points, int a, int b) {
  if (points.col(a).hasNaN() || points.col(b).hasNaN()) return true;
  constexpr double kRounding = 1e-12;  // of the diameter, as in find_coincident()
  return (points.col(a) - points.col(b)).norm() <= kRounding * diameter(points);
}

Landmarks merged(const Landmarks& shape, int first, int second, const Eigen::Vector2d& weights) {
  std::vector<int> others;
  for (int a = 0; a < shape.count(); ++a)
    if (a != second) others.push_back(a);
  Landmarks result = shape;
  Points& x = result.points;
  if (x.col(first).hasNaN())
    x.col(first) = Eigen::VectorXd(x.col(second));
  else if (!x.col(second).hasNaN() && weights.sum() > 0)
    x.col(first) = (weights[0] * x.col(first) + weights[1] * x.col(second)) / weights.sum();
  return selected(result, others);
}

std::string merged_note(const Landmarks& shape, int first, int second, const std::string& shapes) {
  const bool closes = first == 0 && second == shape.count() - 1;
  return fmt::format("{}: landmarks {} and {} are at the same position{}{} and are merged{}", shape.source,
                     shape.describe(first), shape.describe(second), shapes.empty() ? "" : " ", shapes,
                     closes ? ": a closed outline" : "");
}

std::string coincident_error(const Landmarks& shape, int first, int second, const Landmarks& other) {
  return fmt::format(
      "{}: landmarks {} and {} are at the same position, but apart in {}, which no flow can reach: merge them with "
      "`merge_coincident`, or omit one from every file",
      shape.source, shape.describe(first), shape.describe(second), other.source);
}

}  // namespace pulson
