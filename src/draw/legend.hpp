#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "outline.hpp"

namespace pulson::picture {

inline constexpr double kLegendText = 20;
inline constexpr double kEntryGap = 48;      // between entries
inline constexpr double kLegendHeight = 30;  // above the bottom edge
inline constexpr double kSampleGap = 11;     // between a sample and its text

enum class Sample { kDot, kRing, kLine, kArrow, kColourBar };

/// One entry of the legend: a sample and what it means. A colour bar stands between its two texts, which are the ends.
struct LegendEntry {
  Sample sample;
  Colour colour;
  std::string text;
  std::string end_text;
};

/// The groups where the figure has several, else the shape: a dot, or a line where no landmark is marked.
std::vector<LegendEntry> legend_of_shape(const Figure& figure, const Colour& colour, const std::string& text);
LegendEntry legend_of_time(const std::vector<double>& times);

/// The entries in one row around the middle of the canvas, above its bottom edge.
void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries);

}  // namespace pulson::picture
