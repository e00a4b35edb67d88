#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pulson/draw/pictures.hpp"

namespace pulson::charts {

enum class SeriesStyle {
  kLine,
  kPoints,         ///< dots
  kLineAndPoints,  ///< a line with a dot at each value
  kSteps,          ///< a histogram: `x` holds the n+1 edges of the n bins of `y`
  kBars,           ///< a bar around each x, from zero (on a logarithmic axis, from the bottom); several stand abreast
};

/// Values of one kind over x, n of them. Series of the same name share a colour and an entry of the
/// legend. A series without values only has a legend entry; one without a name has none.
struct Series {
  static constexpr int kByName = -1;  ///< names take the colours 0, 1, 2, … as they first appear; no name: colour 0
  static constexpr int kInk = -2;     ///< the colour of text, for what others are compared with

  std::string name;
  std::vector<double> x;           ///< n, of steps n+1 and increasing; of a line, in the order of drawing
  std::vector<double> y;           ///< n
  std::vector<double> error = {};  ///< n, at least 0, drawn as bars from y − error to y + error; may be empty
  std::vector<double> low = {}, high = {};  ///< n each, the borders of a band, low ≤ high; may be empty
  SeriesStyle style = SeriesStyle::kLine;
  int colour = kByName;  ///< 0 to 5, each with marks and dashes of its own; further ones repeat them
  bool dashed = false;   ///< the line of kLine and kLineAndPoints
};

/// A thin horizontal line across a panel, with a small label at its right end.
struct ReferenceLine {
  double y;
  std::string label = {};  ///< may be empty
};

struct ChartPanel {
  std::string heading = {};         ///< above the panel, as are all texts one line or empty
  std::string x_label = {};         ///< below it
  std::string y_label = {};         ///< between heading and panel, because text is never rotated
  std::vector<Series> series = {};  ///< later ones above earlier ones, but all bands and areas below all lines
  std::optional<std::pair<double, double>> y_range = {};  ///< to show, with a small margin; what is beyond is cut off
  std::vector<ReferenceLine> reference_lines = {};
  std::vector<std::string> x_names = {};  ///< below x = 1, 2, 3, … in place of numbers; may be empty
  bool counts_x = false;                  ///< x counts things: tics at whole numbers alone
  bool log_x = false;                     ///< x > 0
  bool log_y = false;  ///< y > 0; bands and errors that reach down to zero or below are cut off at the bottom
};

/// Panels in rows and columns; those of a column share the range of x that have names below, those with logarithmic
/// axes, and all others. A row may
/// be shorter than others; its last panel takes the room that is left, unless another has its horizontal axis.
struct Chart {
  std::string title = {};                     ///< one line, may be empty
  std::string subtitle = {};                  ///< one line, may be empty
  std::vector<std::vector<ChartPanel>> rows;  ///< [row][column]
  bool rows_share_y = false;                  ///< all panels of a row share the range of y, which the first one numbers
};

/// Draws the chart as a PNG 1600 pixels wide and an SVG of the same layout, with one legend of all panels below.
///
/// Long lines are thinned by `simplify_lines`, which keeps the SVG below 2 MB as long as there are no more than some
/// ten thousand dots, bars and bins. Series are identified by name in the legend, so few names read best; a fixed
/// `y_range` of a row that shares its range holds for all of it.
///
/// @throws InputError on a value that is not finite or larger than 1e300, on sizes that disagree, on what a logarithmic
/// axis cannot show, where a folder does not exist; no file is then written. Takes some hundredths of a second;
/// safe to call from several threads.
void write_chart(const Chart& chart, const draw::PictureFiles& files);

}  // namespace pulson::charts
