#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::picture {

/// A closed range of one coordinate.
struct Interval {
  double low;
  double high;

  double span() const { return high - low; }
  double middle() const { return low + span() / 2; }
  Interval joined(const Interval& other) const { return {std::min(low, other.low), std::max(high, other.high)}; }
  /// The interval of the given span around the same middle.
  Interval with_span(double span) const { return {middle() - span / 2, middle() + span / 2}; }
};

/// The values of one coordinate that all of these points take; never empty.
Interval range_of(const std::vector<const Points*>& sets, int row);

/// Round numbers within an interval, and their text.
struct Tics {
  std::vector<double> values;
  std::vector<std::string> texts;
};

/// Tics for an axis `pixels` long: few, at steps of 1, 2 or 5 times a power of ten.
Tics make_tics(const Interval& range, double pixels);

/// A rectangle of the canvas, in pixels.
struct Box {
  double left;
  double bottom;
  double width;
  double height;
};

/// One panel: rows `row_x` and `row_y` of the data, drawn in a box.
struct View {
  Box box;
  Interval x;
  Interval y;
  int row_x = 0;
  int row_y = 1;

  /// Data d×M to pixels 2×M.
  Points pixels(const Points& data) const;
  std::vector<Points> pixels(const std::vector<Points>& data) const;
};

/// Draws the thin frame of a panel with a name above it, tics and numbers at the bottom and, on demand, at the left.
void draw_frame(Canvas& canvas, const View& view, const std::string& heading, bool left_numbers);

/// Room that the numbers at the left of a panel take.
double left_number_width(const Interval& y, double pixels);

}  // namespace pulson::picture
