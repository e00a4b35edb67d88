#pragma once

#include <cstddef>

#include "canvas.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::draw {

/// How a series or a group looks: its colour, and as colour is never alone, its place among the dashes and the shapes
/// of marks.
struct SeriesLook {
  Colour colour;
  std::size_t place = 0;
};

/// Filled marks around the columns of `centres` (2×M), whose areas are about that of a disc of this radius: discs,
/// squares, triangles, diamonds, triangles that point down, crosses, and over again. @param margin of paper around them
void draw_marks(Canvas& canvas, const Points& centres, double radius, const SeriesLook& look, double margin = 0);

}  // namespace pulson::draw
