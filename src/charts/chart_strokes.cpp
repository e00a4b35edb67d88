#include "chart_strokes.hpp"

#include <cmath>

namespace pulson::picture {
namespace {

Points to_points(const std::vector<Eigen::Vector2d>& vertices) {
  Points line(2, static_cast<Eigen::Index>(vertices.size()));
  for (Eigen::Index i = 0; i < line.cols(); ++i) line.col(i) = vertices[static_cast<std::size_t>(i)];
  return line;
}

/// The line with a vertex added at each crossing of the height, which that vertex has exactly.
Points with_crossings(const Points& line, double height) {
  std::vector<Eigen::Vector2d> vertices;
  for (Eigen::Index i = 0; i < line.cols(); ++i) {
    if (i > 0 && (line(1, i - 1) < height) != (line(1, i) < height)) {
      const double s = (height - line(1, i - 1)) / (line(1, i) - line(1, i - 1));
      vertices.emplace_back((1 - s) * line(0, i - 1) + s * line(0, i), height);
    }
    vertices.emplace_back(line.col(i));
  }
  return to_points(vertices);
}

Points with_crossings(const Points& line, const Interval& heights) {
  return with_crossings(with_crossings(line, heights.low), heights.high);
}

}  // namespace

Points clamped(const Points& line, const Interval& heights) {
  Points result = with_crossings(line, heights);
  result.row(1) = result.row(1).cwiseMax(heights.low).cwiseMin(heights.high);
  return result;
}

std::vector<Points> parts_within(const Points& line, const Interval& heights) {
  const Points crossed = with_crossings(line, heights);
  const auto is_inside = [&](Eigen::Index i) { return crossed(1, i) >= heights.low && crossed(1, i) <= heights.high; };
  std::vector<Points> parts;
  for (Eigen::Index first = 0; first < crossed.cols(); ++first) {
    Eigen::Index end = first;
    while (end < crossed.cols() && is_inside(end)) ++end;
    if (end - first > 1) parts.emplace_back(crossed.middleCols(first, end - first));
    first = end;
  }
  return parts;
}

std::vector<Points> dashes_of(const Points& line, double dash, double gap) {
  std::vector<Points> dashes;
  std::vector<Eigen::Vector2d> current;
  double left = dash;  // of the dash or gap under way
  bool draws = true;
  for (Eigen::Index i = 0; i + 1 < line.cols(); ++i) {
    const Eigen::Vector2d from = line.col(i), step = line.col(i + 1) - line.col(i);
    const double length = step.norm();
    if (draws) current.emplace_back(from);
    double done = 0;
    while (length - done > left) {
      done += left;
      current.emplace_back(from + done / length * step);
      if (draws) {
        dashes.push_back(to_points(current));
        current.clear();
      }
      draws = !draws;
      left = draws ? dash : gap;
    }
    left -= length - done;
  }
  if (draws && line.cols() > 1) {
    current.emplace_back(line.col(line.cols() - 1));
    dashes.push_back(to_points(current));
  }
  return dashes;
}

}  // namespace pulson::picture
