#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "canvas.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// A value over time.
struct Curve {
  Points points;  // rows t and value
  Stroke stroke;
};

/// One coordinate of landmark `landmark` at the times of these indices, as a curve.
Points values_over_time(const std::vector<Points>& trajectory, const std::vector<double>& times, int landmark, int row,
                        const std::vector<std::size_t>& indices);

/// How values lie along an axis, the range of all curves with a margin: evenly, or, with a threshold c > 0, at
/// asinh(v / 2c) / ln 10, which counts decades beyond c, is linear within it and keeps the sign.
class ValueAxis {
 public:
  /// Let m(t) > 0 be the largest size of a value at time t. The axis is symmetric logarithmic where the largest m
  /// exceeds the 5 % quantile of m over time by more than four decades; c is the power of ten below that quantile.
  explicit ValueAxis(const std::vector<const Curve*>& curves);

  bool is_logarithmic() const { return threshold_ > 0; }
  double place(double value) const;

  /// Of places.
  const Interval& range() const { return range_; }
  Tics tics(double pixels) const;

 private:
  double threshold_;  // 0: linear
  Interval range_;
};

/// Panels side by side, or one above the other, that share the axis of values.
struct TimeRow {
  std::vector<std::string> headings;        // one for each panel
  std::vector<std::vector<Curve>> columns;  // the curves of each panel, later ones above
  bool zero_line;                           // a thin line at zero
  std::size_t vertices;                     // to draw in all panels together, at most
  bool stacked = false;                     // one above the other
};

/// The row, made ready to be drawn.
class TimePanels {
 public:
  explicit TimePanels(TimeRow row);

  /// Room that the numbers at the left take in panels of this height.
  double number_room(double height) const { return left_number_width(axis_.tics(height)); }

  /// Of the box of panels of this height.
  double height_of(double panel) const;

  /// Draws the panels into the box, which is that of their frames; headings, tics and numbers lie outside.
  void draw(Canvas& canvas, const Box& box) const;

 private:
  TimeRow row_;
  ValueAxis axis_;
  Interval times_;
};

/// Part of a curve or mark that covers others where `count` of them lie on one another.
double opacity(std::size_t count);

/// "12 of 200 paths", or "200 paths" where all are meant.
std::string some_of(std::size_t shown, std::size_t all, std::string_view what);

/// d = 1: positions or momenta over time, in one panel or, where `columns` > 1, in one for each of so many paths.
TimePanels line_panels(const PathPicture& picture, bool momenta, std::size_t columns, bool stacked);

/// d > 1: the components of the momenta over time, each in a panel.
TimePanels component_panels(const PathPicture& picture, bool stacked);

/// The colour of each landmark: on a line by position at the start. In the plane and in space, where time has that
/// palette, few landmarks have the colours of groups.
std::vector<Colour> landmark_colours(const PathPicture& picture);

/// Each landmark in its colour, named by its label or by its number; of many, the scale of colours.
std::vector<LegendEntry> legend_of_landmarks(const PathPicture& picture);

/// The paths but the first whose ends are drawn.
struct Ends {
  std::vector<std::size_t> others;
  std::size_t outside = 0;  // left out for their distance
};

/// As many as `vertices` allow in all. One path that flew off must not shrink all others to a point: an end is left out
/// if its distance from the middle of the start is more than that of the first path ever is, and more than six times
/// the 90 % quantile of all ends.
Ends choose_ends(const PathPicture& picture, std::size_t vertices);

}  // namespace pulson::draw
