#pragma once

#include <cstddef>
#include <vector>

#include "chart_axis.hpp"
#include "chart_strokes.hpp"
#include "charts/chart.hpp"
#include "draw/canvas.hpp"
#include "draw/layout.hpp"

namespace pulson::picture {

/// Where one panel of a chart lies.
struct ChartFrame {
  const ChartPanel* panel;
  ChartAxis x, y;
  Box box = {};
  double heading_height = 0;  // above the box
  bool numbered = true;       // at its left

  /// Heights in pixels that are within the frame.
  Interval heights() const { return {box.bottom, box.bottom + box.height}; }
  /// Places 2×M on the two axes to pixels.
  Points pixels(const Points& places) const { return view().pixels(places); }
  View view() const { return {box, x.range(), y.range()}; }
};

/// The empty canvas of a chart, with its titles, and the frames row by row.
struct ChartPlan {
  Canvas canvas;
  std::vector<ChartFrame> frames;
};

/// `legend_height`: to leave free at the bottom.
ChartPlan plan_chart(const Chart& chart, double legend_height);

/// The frame with its heading, labels, tics and numbers, above what was drawn in it.
void draw_chart_frame(Canvas& canvas, const ChartFrame& frame);

/// The reference lines of a panel; to be drawn first.
void draw_reference_lines(Canvas& canvas, const ChartFrame& frame);

/// The series of the panel within its frame. looks: one for each series; vertices: of each line, at most.
void draw_all_series(Canvas& canvas, const ChartFrame& frame, const std::vector<SeriesLook>& looks,
                     std::size_t vertices);

}  // namespace pulson::picture
