#include "unused_notes.hpp"

#include <cstddef>

#include <fmt/format.h>

#include "text.hpp"

namespace pulson::io {
namespace {

std::size_t count_points(const std::vector<Points>& lines) {
  std::size_t points = 0;
  for (const Points& line : lines) points += static_cast<std::size_t>(line.cols());
  return points;
}

}  // namespace

std::string note_of_scales(const std::vector<Landmarks>& shapes) {
  std::size_t scales = 0;
  for (const Landmarks& shape : shapes) scales += shape.scale ? 1 : 0;
  if (scales == 0) return {};
  return fmt::format(
      "SCALE is recorded ({} of {}) and not applied to the coordinates; `applies_scale` multiplies by it", scales,
      counted(shapes.size(), "shape"));
}

std::string note_of_curves(const std::vector<Landmarks>& shapes) {
  std::size_t curves = 0;
  std::size_t outlines = 0;
  std::size_t points = 0;
  for (const Landmarks& shape : shapes) {
    curves += shape.curves.size();
    outlines += shape.outlines.size();
    points += count_points(shape.curves) + count_points(shape.outlines);
  }
  if (curves + outlines == 0) return {};
  return fmt::format("{} and {} ({}) are kept and not used as landmarks; `curve_points = N` takes N points of each",
                     counted(curves, "curve"), counted(outlines, "outline"), counted(points, "point"));
}

}  // namespace pulson::io
