#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::draw {

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

/// The values of one coordinate that all of these points take; those that are missing (NaN) do not count.
Interval range_of(const std::vector<const Points*>& sets, int row);

/// The ranges of the first coordinates, so many, as with_margins widens them.
std::vector<Interval> ranges_of(const std::vector<const Points*>& sets, int coordinates, double flattest);

/// The lower of the middle values where their number is even. @param values one or more
double median(std::vector<double> values);

/// Where one landmark is at each time, d×K.
Points path_of(const std::vector<Points>& trajectory, Eigen::Index landmark);

/// 1, 2 or 5 times a power of ten, at most `most`; 1 where that is no positive number.
double round_factor(double most);

/// The border of a box, closed.
Points border_of(const Box& box);

/// A straight line, and one point.
inline Points line(double x, double y, double to_x, double to_y) {
  return (Points(2, 2) << x, to_x, y, to_y).finished();
}
inline Points point(double x, double y) { return (Points(2, 1) << x, y).finished(); }

/// Places within an interval that an axis marks, and the text beside each.
struct Tics {
  std::vector<double> values;
  std::vector<std::string> texts;
};

/// Least pixels between tics; one for both axes, so that equal scales get equal steps.
inline constexpr double kTicDistance = 100;

/// Tics for an axis `pixels` long: few, at steps of 1, 2 or 5 times a power of ten.
Tics make_tics(const Interval& range, double pixels, double distance = kTicDistance);

/// The same for a horizontal axis: fewer where the numbers would run into one another.
Tics make_tics_below(const Interval& range, double pixels, double distance = kTicDistance);

/// One panel: rows `row_x` and `row_y` of the data, drawn in a box.
struct View {
  Box box;
  Interval x;
  Interval y;
  int row_x = 0;
  int row_y = 1;
  bool y_down = false;  ///< as rows of an image

  /// Data d×M to pixels 2×M.
  Points pixels(const Points& data) const;
  std::vector<Points> pixels(const std::vector<Points>& data) const;
  /// Height of a coordinate y.
  double height_of(double coordinate) const;
};

/// What a view shows: "x →   z ↑".
std::string axis_names(const View& view);

inline constexpr double kHeadingHeight = 20;  // of its middle above a panel

/// The name of a panel above its box.
void draw_heading(Canvas& canvas, const Box& box, const std::string& heading, double height = kHeadingHeight);

/// Draws the thin frame of a panel with its heading, if any, and tics with numbers at the bottom and at the left.
void draw_frame(Canvas& canvas, const View& view, const std::string& heading, const Tics& x_tics, const Tics& y_tics);

/// The same with tics at round numbers, those at the left on demand.
void draw_frame(Canvas& canvas, const View& view, const std::string& heading, bool left_numbers);

/// "−10⁻³"; the powers 0 and 1 as "1" and "10".
std::string power_of_ten(int exponent, bool negative = false);

/// Width of a number on an axis.
double number_width(const std::string& text);

/// Room that the numbers at the left of a panel take.
double left_number_width(const Tics& tics);
double left_number_width(const Interval& y, double pixels);

// In pixels.
inline constexpr double kWidth = 1600;
inline constexpr double kLeastWidth = 1200;
inline constexpr double kEdge = 26;        // of the canvas
inline constexpr double kGap = 40;         // between panels
inline constexpr double kHeading = 42;     // above a panel
inline constexpr double kTicRoom = 38;     // below a panel
inline constexpr double kLegendRoom = 64;  // below all panels

// Of a layout for screens as narrow as a phone's, where text of 20 pixels is one of 11 to 13.
inline constexpr double kNarrowWidth = 600, kTallestNarrow = 700;

inline constexpr double kMargin = 0.04;  // around the data, of their span

struct Titles {
  std::string title;     // may be empty
  std::string subtitle;  // may be empty
};

double title_height(const Titles& titles);

/// A canvas of whole pixels with its titles, from `left`, above room of the height.
Canvas titled_canvas(const Titles& titles, double left, double width, double height);

/// The ranges with a margin around them; none is less than `flattest` of the widest, and none is empty.
std::vector<Interval> with_margins(std::vector<Interval> ranges, double flattest);

/// How panels of one scale share a canvas.
struct Arrangement {
  bool stacked = false;       // one above the other, not side by side
  double tallest = 0;         // panel, in pixels
  bool all_numbered = false;  // every panel has numbers at its left, not the first alone
  double number_room = 0;     // to leave at the left at least
  double room_below = 0;      // for other panels, between these and the legend
  double least_width = kLeastWidth;
  double most_width = kWidth;
};

/// Of a layout for narrow screens.
inline Arrangement narrow_arrangement() {
  return {.stacked = true,
          .tallest = kTallestNarrow,
          .all_numbered = true,
          .least_width = kNarrowWidth,
          .most_width = kNarrowWidth};
}

/// Writes what `compose(false)` draws and, where the files ask for it, `compose(true)`, its layout for narrow screens:
/// kNarrowWidth wide, panels one above the other, without titles, which pages have themselves.
template <class Compose>
void write_layouts(const PictureFiles& files, const Compose& compose) {
  compose(false).write(files);
  if (files.narrow != nullptr) *files.narrow = compose(true).png({}, 96);
}

/// Panels of one scale: their canvas, with its titles, and where each lies.
struct Plan {
  Canvas canvas;
  std::vector<View> views;
  Box side{};  ///< of arrange_space: room for a view from the side
};

/// The views side by side, tops in one line, or one above the other, at the largest common scale that keeps to the
/// width of the canvas and to the tallest panel.
Plan arrange(const Titles& titles, std::vector<View> views, const Arrangement& arrangement);

/// Pixels per length unit, the same in all views of a plan.
inline double scale_of(const View& view) { return view.box.width / view.x.span(); }

}  // namespace pulson::draw
