#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "charts/chart.hpp"
#include "draw/canvas.hpp"
#include "draw/layout.hpp"
#include "draw/marks.hpp"

namespace pulson::charts {

// Of the marks of a chart, the same in its panels and in its legend; in pixels.
inline constexpr double kLineWidth = 2.2;
inline constexpr double kDenseLineWidth = 1.8;            // of a line so long that it is noise at this scale
inline constexpr std::array<double, 2> kDashed = {9, 8};  // of a series that asks for dashes
inline constexpr double kSideWidth = 1.6;                 // of bins and of bars
inline constexpr double kErrorWidth = 1.8;
inline constexpr double kMostCap = 5;  // half the width of an error bar's ends
inline constexpr double kMostDot = 5.2;
inline constexpr double kMostDotWithError = 3.8;  // lest it hide a short error bar
inline constexpr double kLeastDot = 1.6;
inline constexpr double kDotMargin = 1.4;  // of paper, around a dot

// Transparency of areas.
inline constexpr double kBandFade = 0.8;
inline constexpr double kStepFade = 0.84;
inline constexpr double kBarFade = 0.55;

/// Of a line: none at first, then dashes of their own.
std::span<const double> dashes_at(std::size_t place);

/// Whether a line is so long that dashes would be noise.
bool is_dense(const Series& series);

/// The names of a chart's series, each with its colour and with the kinds of marks that have this colour.
class ChartLegend {
 public:
  /// @throws InputError where series of one name have different colours.
  explicit ChartLegend(const Chart& chart);

  draw::SeriesLook look_of(const Series& series) const;

  /// Room that its first row takes below all panels.
  double height() const { return entries_.empty() ? draw::kEdge : draw::kLegendRoom; }

  /// The entries around the middle of the canvas, above its bottom edge.
  void draw(draw::Canvas& canvas) const;

 private:
  struct Entry {
    std::string name;
    int asked;  // for a colour
    int colour;
    bool band = false, area = false, line = false, dashes = false, dots = false, errors = false;
    bool all_dense = true;  ///< its lines
  };

  void add(const Series& series);
  const Entry* find(const std::string& name) const;
  static void draw_sample(draw::Canvas& canvas, const draw::Box& box, const Entry& entry);

  std::vector<Entry> entries_;
  int by_name_ = 0;  // colours given to names so far
};

}  // namespace pulson::charts
