#include "marks.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace pulson::draw {
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

void draw_marks(Canvas& canvas, const Points& centres, double radius, const SeriesLook& look, double margin) {
  if (margin > 0) draw_marks(canvas, centres, radius + margin, {colour::kPaper, look.place});
  static const std::array<Points, 5> kShapes = {1.25 * polygon(4, 45), 1.4 * polygon(3, 90), 1.3 * polygon(4, 0),
                                                1.4 * polygon(3, -90), 1.25 * cross()};
  const std::size_t shape = look.place % (kShapes.size() + 1);
  if (shape == 0) return canvas.dots(centres, radius, look.colour);
  std::vector<Points> outlines;
  for (Eigen::Index i = 0; i < centres.cols(); ++i)
    outlines.emplace_back((radius * kShapes.at(shape - 1)).colwise() + Eigen::Vector2d(centres.col(i)));
  canvas.areas(outlines, look.colour);
}

}  // namespace pulson::draw
