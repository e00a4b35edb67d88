#include "chart_ranges.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace pulson::picture {
namespace {

constexpr double kBarPart = 0.8;  // of the distance between neighbouring x, that all bars there take
constexpr double kLoneBar = 1;    // that distance where there is one x alone

void append(std::vector<double>& values, const std::vector<double>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

bool is_bars(const Series& series) { return series.style == SeriesStyle::kBars; }

bool stands_on_zero(const Series& series) { return series.style == SeriesStyle::kSteps || is_bars(series); }

/// Whether marks at the first and at the last x would reach out of a frame that ends there.
bool has_wide_marks(const Series& series) {
  return !is_bars(series) &&
         (!series.error.empty() || series.style == SeriesStyle::kPoints || series.style == SeriesStyle::kLineAndPoints);
}

void append_heights(std::vector<double>& values, const Series& series) {
  append(values, series.y);
  append(values, series.low);
  append(values, series.high);
  for (std::size_t i = 0; i < series.error.size(); ++i)
    append(values, {series.y[i] - series.error[i], series.y[i] + series.error[i]});
  if (stands_on_zero(series) && !series.y.empty()) values.push_back(0);
}

/// The least distance between x of the panel's bars.
double bar_distance(const ChartPanel& panel, const ChartAxis& x) {
  std::vector<double> places;
  for (const Series& series : panel.series)
    if (is_bars(series))
      for (const double value : series.x) places.push_back(x.place(value));
  std::sort(places.begin(), places.end());
  double distance = INFINITY;
  for (std::size_t i = 1; i < places.size(); ++i)
    if (places[i] > places[i - 1]) distance = std::min(distance, places[i] - places[i - 1]);
  return std::isfinite(distance) ? distance : kLoneBar;
}

/// Both ends of the room of all bars at each x, with the gap to the next ones.
void append_bar_sides(std::vector<double>& values, const ChartPanel& panel, const ChartAxis& x) {
  const double half = bar_distance(panel, x) / 2;
  for (const Series& series : panel.series) {
    if (!is_bars(series)) continue;
    for (const double value : series.x)
      for (const double side : {x.place(value) - half, x.place(value) + half})
        values.push_back(x.is_logarithmic() ? std::pow(10.0, side) : side);
  }
}

}  // namespace

double bar_width(const ChartPanel& panel, const ChartAxis& x) {
  const auto abreast = std::count_if(panel.series.begin(), panel.series.end(), is_bars);
  return kBarPart * bar_distance(panel, x) / std::max(static_cast<double>(abreast), 1.0);
}

ChartAxis horizontal_axis(const std::vector<const ChartPanel*>& column) {
  std::vector<double> values;
  bool has_margin = false;
  const ChartAxis scale({}, column.front()->log_x);
  for (const ChartPanel* panel : column) {
    for (const Series& series : panel->series) {
      append(values, series.x);
      has_margin = has_margin || has_wide_marks(series);
    }
    append_bar_sides(values, *panel, scale);
  }
  const auto names = std::max_element(column.begin(), column.end(), [](const ChartPanel* one, const ChartPanel* other) {
    return one->x_names.size() < other->x_names.size();
  });
  if (!(*names)->x_names.empty()) append(values, {0.5, static_cast<double>((*names)->x_names.size()) + 0.5});
  ChartAxis axis(values, column.front()->log_x);
  axis.set_names((*names)->x_names);
  if ((has_margin && (*names)->x_names.empty()) || axis.range().span() <= 0) axis.add_margins(false);
  return axis;
}

ChartAxis vertical_axis(const std::vector<const ChartPanel*>& panels) {
  std::vector<double> asked, drawn;
  bool keeps_zero = false;
  for (const ChartPanel* panel : panels) {
    if (panel->y_range) append(asked, {panel->y_range->first, panel->y_range->second});
    for (const Series& series : panel->series) {
      append_heights(drawn, series);
      keeps_zero = keeps_zero || stands_on_zero(series);
    }
    for (const ReferenceLine& line : panel->reference_lines) drawn.push_back(line.y);
  }
  ChartAxis axis(asked.empty() ? drawn : asked, panels.front()->log_y);
  axis.add_margins(keeps_zero);
  return axis;
}

}  // namespace pulson::picture
