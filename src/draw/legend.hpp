#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "marks.hpp"

namespace pulson::draw {

/// One entry of the legend: a sample and what it means.
struct LegendEntry {
  std::string text;
  double width;                                       // of the sample
  std::function<void(Canvas&, const Box& box)> draw;  // the sample
  std::string text_before = {};                       // of a colour bar, whose texts are its ends
};

LegendEntry dot_entry(const std::string& text, const SeriesLook& look);
LegendEntry ring_entry(const std::string& text, const Colour& colour);
LegendEntry line_entry(const std::string& text, const Colour& colour);
LegendEntry arrow_entry(const std::string& text, const Colour& colour);
/// Colours of parts in [0, 1], those of time if not others, from one text to the other.
LegendEntry bar_entry(const std::string& text_before, const std::string& text,
                      const std::function<Colour(double)>& colour = time_colour);

/// The entries around the middle of the canvas, above its bottom edge, in as many rows as they need: the canvas grows
/// below its first row.
void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries);

}  // namespace pulson::draw
