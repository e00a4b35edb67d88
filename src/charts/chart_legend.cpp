
#include <algorithm>

#include <fmt/format.h>

#include "chart_strokes.hpp"
#include "draw/layers.hpp"
#include "draw/layout.hpp"
#include "draw/legend.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::charts {
namespace {

constexpr double kSampleWidth = 40;
constexpr double kSwatchWidth = 24, kSwatchHeight = 15;  // of an area

draw::SeriesLook look_at(int index) {
  if (index == Series::kInk) return {draw::colour::kResult, 0};
  const auto place = static_cast<std::size_t>(index);
  return {draw::group_colour(place), place};
}

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

void ChartLegend::draw_sample(draw::Canvas& canvas, const draw::Box& box, const Entry& entry) {
  const double x = box.left + box.width / 2, middle = box.bottom + box.height / 2;
  const draw::SeriesLook look = look_at(entry.colour);
  const draw::Colour& colour = look.colour;
  const Points whole = draw::line(box.left, middle, box.right(), middle);
  if (entry.band) canvas.areas({draw::border_of(box)}, draw::faded(colour, kBandFade));
  if (entry.area && !entry.line && !entry.dashes && !entry.dots) {  // one mark alone is read at a glance
    const Points swatch =
        draw::border_of({x - kSwatchWidth / 2, middle - kSwatchHeight / 2, kSwatchWidth, kSwatchHeight});
    canvas.areas({swatch}, draw::faded(colour, kStepFade));
    canvas.lines({swatch}, {colour, kSideWidth});
  }
  const std::span<const double> pattern = entry.all_dense ? std::span<const double>() : dashes_at(look.place);
  if (entry.line) canvas.lines({whole}, {colour, kLineWidth, pattern});
  if (entry.dashes && !entry.line) canvas.lines({whole}, {colour, kLineWidth, kDashed});
  if (entry.errors)
    canvas.lines(
        {draw::line(x, box.bottom, x, box.top()), draw::line(x - kMostCap, box.bottom, x + kMostCap, box.bottom),
         draw::line(x - kMostCap, box.top(), x + kMostCap, box.top())},
        {colour, kErrorWidth});
  if (entry.dots) draw_marks(canvas, draw::point(x, middle), entry.errors ? kMostDotWithError : kMostDot, look);
}

void ChartLegend::draw(draw::Canvas& canvas) const {
  std::vector<draw::LegendEntry> entries;
  for (const Entry& entry : entries_)
    entries.push_back(
        {entry.name, kSampleWidth, [&](draw::Canvas& on, const draw::Box& box) { draw_sample(on, box, entry); }});
  draw_legend(canvas, entries);
}

}  // namespace pulson::charts
