#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "view.hpp"

namespace pulson::picture {

// In pixels.
inline constexpr double kWidth = 1600;
inline constexpr double kLeastWidth = 1200;
inline constexpr double kEdge = 26;        // of the canvas
inline constexpr double kGap = 40;         // between panels
inline constexpr double kHeading = 42;     // above a panel
inline constexpr double kTicRoom = 38;     // below a panel
inline constexpr double kLegendRoom = 64;  // below all panels

inline constexpr double kMargin = 0.04;  // around the data, of their span

struct Titles {
  std::string title;     // may be empty
  std::string subtitle;  // may be empty
};

/// Title and subtitle from `left`, below the top edge.
void draw_titles(Canvas& canvas, const Titles& titles, double left);
double title_height(const Titles& titles);

/// The ranges with a margin around them; none is less than `flattest` of the widest, and none is empty.
std::vector<Interval> with_margins(std::vector<Interval> ranges, double flattest);

/// How panels of one scale share a canvas.
struct Arrangement {
  bool stacked;            // one above the other, not side by side
  double tallest;          // panel, in pixels
  bool all_numbered;       // every panel has numbers at its left, not the first alone
  double number_room = 0;  // to leave at the left at least
  double room_below = 0;   // for other panels, between these and the legend
  double least_width = kLeastWidth;
};

/// Panels of one scale: their canvas, with its titles, and where each lies.
struct Plan {
  Canvas canvas;
  std::vector<View> views;
};

/// The views side by side, tops in one line, or one above the other, at the largest common scale that keeps to the
/// width of the canvas and to the tallest panel.
Plan arrange(const Titles& titles, std::vector<View> views, const Arrangement& arrangement);

/// Pixels per length unit, the same in all views of a plan.
inline double scale_of(const View& view) { return view.box.width / view.x.span(); }

}  // namespace pulson::picture
