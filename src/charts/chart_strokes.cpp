#include "chart_strokes.hpp"

#include <cmath>
#include <numbers>

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

std::vector<Points> dashes_of(const Points& line, std::span<const double> pattern) {
  if (pattern.empty()) return {line};
  std::vector<Points> dashes;
  std::vector<Eigen::Vector2d> current;
  std::size_t part = 0;           // of the pattern, which begins with a dash
  double left = pattern.front();  // of the dash or gap under way
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
      part = (part + 1) % pattern.size();
      left = pattern[part];
    }
    left -= length - done;
  }
  if (draws && line.cols() > 1) {
    current.emplace_back(line.col(line.cols() - 1));
    dashes.push_back(to_points(current));
  }
  return dashes;
}

std::span<const double> dashes_at(std::size_t place) {
  static constexpr std::array<double, 2> kLong = {16, 6}, kShort = {6, 5}, kDots = {2.5, 5};
  static constexpr std::array<double, 4> kDashDot = {14, 5, 2.5, 5}, kTwoDashes = {14, 4, 6, 4};
  constexpr std::size_t kPatterns = 6;
  switch (place % kPatterns) {
    case 1:
      return kLong;
    case 2:
      return kDashDot;
    case 3:
      return kShort;
    case 4:
      return kTwoDashes;
    case 5:
      return kDots;
    default:
      return {};
  }
}

namespace {

/// A regular polygon of radius 1, its first corner in the direction of `degrees`.
Points polygon(int corners, double degrees) {
  Points outline(2, corners);
  for (int i = 0; i < corners; ++i) {
    const double angle = (degrees + 360.0 * i / corners) * std::numbers::pi / 180;
    outline.col(i) << std::cos(angle), std::sin(angle);
  }
  return outline;
}

/// A cross with arms that reach to 1.
Points cross() {
  constexpr double kArm = 0.36;
  Points outline(2, 12);
  outline.row(0) << kArm, kArm, 1, 1, kArm, kArm, -kArm, -kArm, -1, -1, -kArm, -kArm;
  outline.row(1) << 1, kArm, kArm, -kArm, -kArm, -1, -1, -kArm, -kArm, kArm, kArm, 1;
  return outline;
}

}  // namespace

void draw_marks(Canvas& canvas, const Points& centres, double radius, const SeriesLook& look) {
  static const std::array<Points, 5> kShapes = {1.25 * polygon(4, 45), 1.4 * polygon(3, 90), 1.3 * polygon(4, 0),
                                                1.4 * polygon(3, -90), 1.25 * cross()};
  const std::size_t shape = look.place % (kShapes.size() + 1);
  if (shape == 0) return canvas.dots(centres, radius, look.colour);
  std::vector<Points> outlines;
  for (Eigen::Index i = 0; i < centres.cols(); ++i)
    outlines.emplace_back((radius * kShapes.at(shape - 1)).colwise() + Eigen::Vector2d(centres.col(i)));
  canvas.areas(outlines, look.colour);
}

}  // namespace pulson::picture
