#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "chart_strokes.hpp"
#include "charts/chart.hpp"
#include "draw/canvas.hpp"
#include "draw/layout.hpp"

namespace pulson::charts {

/// An axis of a chart: values lie at their places on it, which are the values themselves or their decimal logarithms.
class ChartAxis {
 public:
  /// Shows at least these values; 0 to 1 (or 1 to 10) where there are none. On a logarithmic axis, those that are not
  /// above zero are left out.
  ChartAxis(const std::vector<double>& values, bool logarithmic);

  /// Widens the range by the usual margin at its two ends; at its low end not where it starts at zero and
  /// `keeps_zero`, for what stands on zero stands on the frame.
  void add_margins(bool keeps_zero);

  bool is_logarithmic() const { return logarithmic_; }

  /// Of what is not above zero on a logarithmic axis: below the place of any number.
  double place(double value) const;
  Eigen::RowVectorXd places(const std::vector<double>& values) const;

  /// Where bars and areas stand: at zero or, on a logarithmic axis, at the bottom.
  double base() const { return logarithmic_ ? range_.low : 0; }

  /// Of places.
  const draw::Interval& range() const { return range_; }

  /// Of a vertical axis so many pixels long.
  draw::Tics tics(double pixels) const;
  /// Of a horizontal one: at numbers or, where there are names, at these.
  draw::Tics tics_below(double pixels) const;

  /// Names of x = 1, 2, 3, …; those wider than their room are left out.
  void set_names(std::vector<std::string> names) { names_ = std::move(names); }
  /// Tics below at whole numbers alone.
  void set_counts() { counts_ = true; }

 private:
  draw::Tics tics_at_names(double pixels) const;

  bool logarithmic_;
  draw::Interval range_;
  std::vector<std::string> names_;
  bool counts_ = false;
};

/// Width of each bar of the panel's bar series, in places on its horizontal axis.
double bar_width(const ChartPanel& panel, const ChartAxis& x);

/// The horizontal axis of panels one above the other, all of them with names below or none: all of their x, with a
/// margin where marks would touch the frame.
ChartAxis horizontal_axis(const std::vector<const ChartPanel*>& column);

/// The vertical axis of panels that share it: the ranges that are asked for or, where there are none, all that is
/// drawn.
ChartAxis vertical_axis(const std::vector<const ChartPanel*>& panels);

/// Where one panel of a chart lies.
struct ChartFrame {
  const ChartPanel* panel;
  ChartAxis x, y;
  draw::Box box = {};
  double heading_height = 0;  // above the box
  bool numbered = true;       // at its left

  /// Heights in pixels that are within the frame.
  draw::Interval heights() const { return {box.bottom, box.bottom + box.height}; }
  /// Places 2×M on the two axes to pixels.
  Points pixels(const Points& places) const { return view().pixels(places); }
  draw::View view() const { return {box, x.range(), y.range()}; }
  /// What of the series is seen: lines on the frame in their whole width.
  draw::Box window() const { return box.grown(kLineWidth / 2); }
};

/// The empty canvas of a chart, with its titles, and the frames row by row.
struct ChartPlan {
  draw::Canvas canvas;
  std::vector<ChartFrame> frames;
};

/// `legend_height`: to leave free at the bottom. `narrow`: for narrow screens, in one column without titles; axes are
/// shared as in the wide layout.
ChartPlan plan_chart(const Chart& chart, double legend_height, bool narrow);

/// The frame with its heading, labels, tics and numbers, above what was drawn in it.
void draw_chart_frame(draw::Canvas& canvas, const ChartFrame& frame);

/// The reference lines of a panel; to be drawn first.
void draw_reference_lines(draw::Canvas& canvas, const ChartFrame& frame);

/// The series of the panel within its frame. looks: one for each series; vertices: of each line, at most.
void draw_all_series(draw::Canvas& canvas, const ChartFrame& frame, const std::vector<draw::SeriesLook>& looks,
                     std::size_t vertices);

}  // namespace pulson::charts
