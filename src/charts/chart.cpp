#include "charts/chart.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "chart_layout.hpp"
#include "chart_strokes.hpp"
#include "draw/checks.hpp"

namespace pulson::charts {
namespace {

constexpr std::size_t kVertices = 40000;    // of all lines together; an SVG takes some 16 bytes for a vertex
constexpr std::size_t kFewestVertices = 8;  // of one line

/// Refuses what a chart cannot show.
class ChartChecks {
 public:
  void chart(const Chart& chart) {
    if (chart.rows.empty()) checks_.refuse("there are no panels");
    for (std::size_t r = 0; r < chart.rows.size(); ++r) {
      if (chart.rows[r].empty()) checks_.refuse(fmt::format("row {} has no panels", r + 1));
      for (std::size_t c = 0; c < chart.rows[r].size(); ++c) {
        where_ = fmt::format("in row {}, column {}, ", r + 1, c + 1);
        panel(chart.rows[r][c]);
        if (chart.rows_share_y && chart.rows[r][c].log_y != chart.rows[r][0].log_y)
          refuse("log_y differs from that of the row, which shares the range of y");
      }
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { checks_.refuse(where_ + why); }

  void panel(const ChartPanel& panel) {
    if (panel.y_range) {
      values({panel.y_range->first, panel.y_range->second}, "y_range", panel.log_y);
      if (panel.y_range->first >= panel.y_range->second) refuse("y_range is empty");
    }
    for (const ReferenceLine& line : panel.reference_lines) values({line.y}, "a reference line", panel.log_y);
    const std::string place = where_;
    for (std::size_t i = 0; i < panel.series.size(); ++i) {
      where_ = place + (panel.series[i].name.empty() ? fmt::format("series {}, ", i + 1)
                                                     : fmt::format("series '{}', ", panel.series[i].name));
      series(panel.series[i], panel);
    }
    where_ = place;
  }

  void series(const Series& series, const ChartPanel& panel) const {
    const std::size_t n = series.y.size();
    const bool steps = series.style == SeriesStyle::kSteps;
    if (series.x.size() != (steps && n > 0 ? n + 1 : n))
      refuse(fmt::format("{} {} for {} values", series.x.size(), steps ? "edges of bins" : "x", n));
    if (series.colour < Series::kInk) refuse(fmt::format("there is no colour {}", series.colour));
    values(series.x, "x", panel.log_x);
    values(series.y, "y", panel.log_y);
    errors(series);
    band(series);
    if (steps && std::adjacent_find(series.x.begin(), series.x.end(), std::greater_equal<>()) != series.x.end())
      refuse("the edges of its bins do not increase");
  }

  void errors(const Series& series) const {
    if (series.error.empty()) return;
    count(series.error, series, "errors");
    values(series.error, "error", false);
    if (*std::min_element(series.error.begin(), series.error.end()) < 0) refuse("an error is negative");
  }

  void band(const Series& series) const {
    if (series.low.empty() && series.high.empty()) return;
    count(series.low, series, "low borders of a band");
    count(series.high, series, "high borders of a band");
    values(series.low, "low", false);
    values(series.high, "high", false);
    for (std::size_t i = 0; i < series.low.size(); ++i)
      if (series.low[i] > series.high[i])
        refuse(fmt::format("low {} is {}, above high, {}", i + 1, series.low[i], series.high[i]));
  }

  void count(const std::vector<double>& values, const Series& series, std::string_view what) const {
    if (values.size() != series.y.size())
      refuse(fmt::format("{} {} for {} values", values.size(), what, series.y.size()));
  }

  void values(const std::vector<double>& values, std::string_view what, bool logarithmic) const {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::string which = values.size() > 1 ? fmt::format("{} {}", what, i + 1) : std::string(what);
      if (!draw::can_be_drawn(values[i]))
        refuse(
            fmt::format("{} is {}; it must be finite and no larger than {:g}", which, values[i], draw::kLargestDrawn));
      if (logarithmic && values[i] <= 0)
        refuse(fmt::format("{} is {}, which a logarithmic axis cannot show", which, values[i]));
    }
  }

  draw::Checks checks_{"chart"};
  std::string where_;
};

std::size_t count_lines(const Chart& chart) {
  std::size_t lines = 0;
  for (const auto& row : chart.rows)
    for (const ChartPanel& panel : row)
      for (const Series& series : panel.series) lines += series.low.empty() ? 1 : 3;
  return lines;
}

draw::Canvas compose(const Chart& chart, const ChartLegend& legend, bool narrow) {
  ChartPlan plan = plan_chart(chart, legend.height(), narrow);
  const std::size_t vertices = std::max(kFewestVertices, kVertices / std::max<std::size_t>(count_lines(chart), 1));
  for (const ChartFrame& frame : plan.frames) {
    std::vector<draw::SeriesLook> looks;
    for (const Series& series : frame.panel->series) looks.push_back(legend.look_of(series));
    draw_reference_lines(plan.canvas, frame);
    draw_all_series(plan.canvas, frame, looks, vertices);
    draw_chart_frame(plan.canvas, frame);
  }
  legend.draw(plan.canvas);
  return std::move(plan.canvas);
}

}  // namespace

void write_chart(const Chart& chart, const draw::PictureFiles& files) {
  ChartChecks().chart(chart);
  const ChartLegend legend(chart);
  write_layouts(files, [&](bool narrow) { return compose(chart, legend, narrow); });
}

}  // namespace pulson::charts
