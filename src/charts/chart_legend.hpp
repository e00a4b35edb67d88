#pragma once

#include <string>
#include <vector>

#include "chart_strokes.hpp"
#include "charts/chart.hpp"
#include "draw/canvas.hpp"

namespace pulson::picture {

/// The names of a chart's series, each with its colour and with the kinds of marks that have this colour.
class ChartLegend {
 public:
  /// @throws InputError where series of one name have different colours.
  explicit ChartLegend(const Chart& chart);

  SeriesLook look_of(const Series& series) const;

  /// Room that it takes below all panels.
  double height() const;

  /// The entries around the middle of the canvas, above its bottom edge.
  void draw(Canvas& canvas) const;

 private:
  struct Entry {
    std::string name;
    int asked;  // for a colour
    int colour;
    bool band = false, area = false, line = false, dashes = false, dots = false, errors = false;
  };

  void add(const Series& series);
  const Entry* find(const std::string& name) const;
  /// Entries fill row after row of a table with as many columns as there is room for.
  std::vector<double> column_widths() const;
  std::size_t count_rows() const;
  static double width_of(const Entry& entry);
  static void draw_sample(Canvas& canvas, double left, double middle, const Entry& entry);

  std::vector<Entry> entries_;
  int by_name_ = 0;  // colours given to names so far
};

}  // namespace pulson::picture
