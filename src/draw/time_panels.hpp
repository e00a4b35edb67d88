#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "layout.hpp"

namespace pulson::picture {

/// A value over time.
struct Curve {
  Points points;  // rows t and value
  Stroke stroke;
  bool faint;  // one of many that lie below others
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

/// Panels side by side that share the axis of values.
struct TimeRow {
  std::vector<std::string> headings;        // one for each panel
  std::vector<std::vector<Curve>> columns;  // the curves of each panel, later ones above
  bool zero_line;                           // a thin line at zero
  std::size_t vertices;                     // to draw in all panels together, at most
};

/// The row, made ready to be drawn.
class TimePanels {
 public:
  explicit TimePanels(TimeRow row);

  /// Room that the numbers at the left take in panels of this height.
  double number_room(double height) const { return left_number_width(axis_.tics(height)); }

  /// Draws the panels into the box, which is that of their frames; headings, tics and numbers lie outside.
  void draw(Canvas& canvas, const Box& box) const;

 private:
  void draw_curves(Canvas& canvas, const View& view, const std::vector<Curve>& curves) const;

  TimeRow row_;
  ValueAxis axis_;
  Interval times_;
};

}  // namespace pulson::picture
