
#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "chart_strokes.hpp"
#include "draw/layers.hpp"
#include "draw/layout.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::charts {
namespace {

constexpr double kRowHeight = 34;
constexpr double kSampleWidth = 40;
constexpr double kSampleHeight = 20;
constexpr double kSwatchWidth = 24;  // of an area
constexpr double kSwatchHeight = 15;

draw::SeriesLook look_at(int index) {
  if (index == Series::kInk) return {draw::colour::kResult, 0};
  const auto place = static_cast<std::size_t>(index);
  return {draw::group_colour(place), place};
}

Points rectangle(double middle_x, double middle_y, double width, double height) {
  const double left = middle_x - width / 2, right = left + width, low = middle_y - height / 2, high = low + height;
  return (Points(2, 5) << left, right, right, left, left, low, low, high, high, low).finished();
}

double total_width(const std::vector<double>& columns) {
  return std::accumulate(columns.begin(), columns.end(), -draw::kEntryGap,
                         [](double sum, double width) { return sum + width + draw::kEntryGap; });
}

Points line(double x, double y, double to_x, double to_y) { return (Points(2, 2) << x, to_x, y, to_y).finished(); }

}  // namespace

ChartLegend::ChartLegend(const Chart& chart) {
  for (const auto& row : chart.rows)
    for (const ChartPanel& panel : row)
      for (const Series& series : panel.series)
        if (!series.name.empty()) add(series);
}

const ChartLegend::Entry* ChartLegend::find(const std::string& name) const {
  const auto place =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.name == name; });
  return place == entries_.end() ? nullptr : &*place;
}

void ChartLegend::add(const Series& series) {
  if (find(series.name) == nullptr)
    entries_.push_back({.name = series.name,
                        .asked = series.colour,
                        .colour = series.colour == Series::kByName ? by_name_++ : series.colour});
  Entry& entry = entries_[static_cast<std::size_t>(find(series.name) - entries_.data())];
  if (entry.asked != series.colour)
    throw InputError(fmt::format("chart: the series named '{}' have different colours, {} and {}", series.name,
                                 entry.asked, series.colour));
  const SeriesStyle style = series.style;
  const bool has_line = style == SeriesStyle::kLine || style == SeriesStyle::kLineAndPoints;
  entry.band = entry.band || !series.low.empty();
  entry.area = entry.area || style == SeriesStyle::kSteps || style == SeriesStyle::kBars;
  entry.line = entry.line || (has_line && !series.dashed);
  entry.dashes = entry.dashes || (has_line && series.dashed);
  entry.all_dense = entry.all_dense && (!has_line || is_dense(series));
  entry.dots = entry.dots || style == SeriesStyle::kPoints || style == SeriesStyle::kLineAndPoints;
  entry.errors = entry.errors || !series.error.empty();
}

draw::SeriesLook ChartLegend::look_of(const Series& series) const {
  const Entry* const entry = series.name.empty() ? nullptr : find(series.name);
  return look_at(entry != nullptr ? entry->colour : series.colour == Series::kByName ? 0 : series.colour);
}

double ChartLegend::width_of(const Entry& entry) {
  return kSampleWidth + draw::kSampleGap + draw::text_width(entry.name, draw::kLegendText);
}

std::vector<double> ChartLegend::column_widths() const {
  std::vector<double> widths;
  for (std::size_t rows = 1; rows <= entries_.size(); ++rows) {
    widths.assign((entries_.size() + rows - 1) / rows, 0);
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      double& width = widths[i % widths.size()];
      width = std::max(width, width_of(entries_[i]));
    }
    if (total_width(widths) <= draw::kWidth - 2 * draw::kEdge) break;
  }
  return widths;
}

std::size_t ChartLegend::count_rows() const {
  const std::size_t columns = column_widths().size();
  return (entries_.size() + columns - 1) / columns;
}

double ChartLegend::height() const {
  return entries_.empty() ? draw::kEdge : draw::kLegendRoom + kRowHeight * (static_cast<double>(count_rows()) - 1);
}

void ChartLegend::draw_sample(draw::Canvas& canvas, double left, double middle, const Entry& entry) {
  const double x = left + kSampleWidth / 2;
  const draw::SeriesLook look = look_at(entry.colour);
  const draw::Colour& colour = look.colour;
  const Points whole = line(left, middle, left + kSampleWidth, middle);
  if (entry.band) canvas.areas({rectangle(x, middle, kSampleWidth, kSampleHeight)}, draw::faded(colour, kBandFade));
  if (entry.area && !entry.line && !entry.dashes && !entry.dots) {  // one mark alone is read at a glance
    const Points swatch = rectangle(x, middle, kSwatchWidth, kSwatchHeight);
    canvas.areas({swatch}, draw::faded(colour, kStepFade));
    canvas.lines({swatch}, {colour, kSideWidth});
  }
  const std::span<const double> pattern = entry.all_dense ? std::span<const double>() : dashes_at(look.place);
  if (entry.line) canvas.lines(dashes_of(whole, pattern), {colour, kLineWidth});
  if (entry.dashes && !entry.line) canvas.lines(dashes_of(whole, kDashed), {colour, kLineWidth});
  if (entry.errors) {
    const double low = middle - kSampleHeight / 2, high = middle + kSampleHeight / 2;
    canvas.lines({line(x, low, x, high), line(x - kMostCap, low, x + kMostCap, low),
                  line(x - kMostCap, high, x + kMostCap, high)},
                 {colour, kErrorWidth});
  }
  if (entry.dots) {
    const Points centre = (Points(2, 1) << x, middle).finished();
    draw_marks(canvas, centre, entry.errors ? kMostDotWithError : kMostDot, look);
  }
}

void ChartLegend::draw(draw::Canvas& canvas) const {
  const std::vector<double> widths = column_widths();
  const double first_left = std::max(draw::kEdge, (canvas.width() - total_width(widths)) / 2);
  double left = first_left, middle = height() - draw::kLegendRoom + draw::kLegendHeight;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    draw_sample(canvas, left, middle, entries_[i]);
    const double text_left = left + kSampleWidth + draw::kSampleGap;
    canvas.text(text_left, middle, entries_[i].name, draw::kLegendText, draw::colour::kText, draw::Align::kLeft,
                canvas.width() - draw::kEdge - text_left);
    const std::size_t column = i % widths.size();
    left += widths[column] + draw::kEntryGap;
    if (column + 1 < widths.size()) continue;
    left = first_left;
    middle -= kRowHeight;
  }
}

}  // namespace pulson::charts
