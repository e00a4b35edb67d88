#include "chart_layout.hpp"

#include <algorithm>
#include <cmath>

#include "chart_axis.hpp"
#include "draw/layout.hpp"

namespace pulson::picture {
namespace {

constexpr double kLabelSize = 18;
constexpr double kYLabelRoom = 26;  // between heading and panel
constexpr double kXLabelRoom = 28;  // below the numbers
constexpr double kNoHeading = 18;   // above a panel that has none
constexpr double kNumbers = 70;     // first guess of those at the left
constexpr double kReferenceGap = 9;
constexpr double kNumberGap = 18;   // between numbers of neighbouring panels
constexpr double kFlatness = 0.66;  // height of a panel by its width
constexpr double kTallest = 560;
constexpr double kTallestOfSeveral = 430;
constexpr double kShortest = 240;
constexpr double kTallestChart = 1560;

using Row = std::vector<ChartPanel>;

bool any_in(const Row& row, std::string ChartPanel::*text) {
  return std::any_of(row.begin(), row.end(), [text](const ChartPanel& panel) { return !(panel.*text).empty(); });
}

double y_label_room(const Row& row) { return any_in(row, &ChartPanel::y_label) ? kYLabelRoom : 0; }

double room_above(const Row& row) {
  return (any_in(row, &ChartPanel::heading) ? kHeading : kNoHeading) + y_label_room(row);
}

double room_below(const Row& row) { return kTicRoom + (any_in(row, &ChartPanel::x_label) ? kXLabelRoom : 0); }

double reference_room(const ChartPanel& panel) {
  double room = 0;
  for (const ReferenceLine& line : panel.reference_lines)
    if (!line.label.empty()) room = std::max(room, kReferenceGap + number_width(line.label));
  return room;
}

std::size_t count_columns(const Chart& chart) {
  std::size_t columns = 0;
  for (const Row& row : chart.rows) columns = std::max(columns, row.size());
  return columns;
}

/// The horizontal axis of a panel in that column, which it shares with those of its kind there.
ChartAxis shared_horizontal_axis(const Chart& chart, std::size_t column, const ChartPanel& panel) {
  std::vector<const ChartPanel*> alike;
  for (const Row& row : chart.rows)
    if (column < row.size() && row[column].x_names.empty() == panel.x_names.empty()) alike.push_back(&row[column]);
  return horizontal_axis(alike);
}

/// The frames of the chart with their axes, but without their boxes; [row][column].
std::vector<std::vector<ChartFrame>> make_frames(const Chart& chart) {
  std::vector<std::vector<ChartFrame>> frames;
  for (const Row& row : chart.rows) {
    std::vector<const ChartPanel*> all;
    for (const ChartPanel& panel : row) all.push_back(&panel);
    frames.emplace_back();
    for (std::size_t c = 0; c < row.size(); ++c) {
      const auto y = chart.rows_share_y ? vertical_axis(all) : vertical_axis({&row[c]});
      const auto x = shared_horizontal_axis(chart, c, row[c]);
      frames.back().push_back({.panel = &row[c], .x = x, .y = y, .numbered = c == 0 || !chart.rows_share_y});
    }
  }
  return frames;
}

/// Room of one column besides its panels.
struct Sides {
  double left = 0;
  double right = 0;
};

std::vector<Sides> sides_of(const std::vector<std::vector<ChartFrame>>& frames, std::size_t columns, double height) {
  std::vector<Sides> sides(columns);
  for (const auto& row : frames)
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (row[c].numbered) sides[c].left = std::max(sides[c].left, left_number_width(row[c].y.tics(height)));
      sides[c].right = std::max(sides[c].right, reference_room(*row[c].panel));
      if (c == 0) continue;
      double widest = 0;  // of the numbers below, which reach into the gap from both sides
      for (const std::string& text : row[c].x.tics_below(kWidth / static_cast<double>(columns) - kNumbers).texts)
        widest = std::max(widest, number_width(text));
      sides[c].left = std::max(sides[c].left, widest + kNumberGap - kGap);
    }
  return sides;
}

double panel_height(const Chart& chart, double fixed_heights) {
  const auto rows = static_cast<double>(chart.rows.size()), columns = static_cast<double>(count_columns(chart));
  const double width = (kWidth - 2 * kEdge - columns * kNumbers) / columns;
  const double height = std::min(kFlatness * width, rows > 1 ? kTallestOfSeveral : kTallest);
  return std::round(std::max(kShortest, std::min(height, (kTallestChart - fixed_heights) / rows)));
}

void draw_labels(Canvas& canvas, const ChartFrame& frame, double heading_height) {
  const ChartPanel& panel = *frame.panel;
  const Box& box = frame.box;
  if (!panel.heading.empty()) draw_heading(canvas, box, panel.heading, heading_height);
  if (!panel.y_label.empty())
    canvas.text(box.left, box.bottom + box.height + 17, panel.y_label, kLabelSize, colour::kText, Align::kLeft,
                box.width);
  if (!panel.x_label.empty())
    canvas.text(box.left + box.width / 2, box.bottom - kTicRoom - kXLabelRoom / 2 + 4, panel.x_label, kLabelSize,
                colour::kText, Align::kCentre, box.width);
}

}  // namespace

ChartPlan plan_chart(const Chart& chart, double legend_height) {
  const Titles titles{chart.title, chart.subtitle};
  double fixed_heights = title_height(titles) + legend_height;
  for (const Row& row : chart.rows) fixed_heights += room_above(row) + room_below(row);
  const double height = panel_height(chart, fixed_heights);

  std::vector<std::vector<ChartFrame>> frames = make_frames(chart);
  const std::size_t columns = count_columns(chart);
  const std::vector<Sides> sides = sides_of(frames, columns, height);
  double free = kWidth - 2 * kEdge - kGap * (static_cast<double>(columns) - 1);
  for (const Sides& side : sides) free -= side.left + side.right;
  const double width = free / static_cast<double>(columns);

  ChartPlan plan{{kWidth, std::round(fixed_heights + height * static_cast<double>(chart.rows.size()))}, {}};
  draw_titles(plan.canvas, titles, kEdge + sides.front().left);
  double top = plan.canvas.height() - title_height(titles);
  for (std::size_t r = 0; r < frames.size(); ++r) {
    const Row& row = chart.rows[r];
    double left = kEdge;
    for (std::size_t c = 0; c < row.size(); ++c) {
      frames[r][c].box = {left + sides[c].left, top - room_above(row) - height, width, height};
      frames[r][c].heading_height = kHeadingHeight + y_label_room(row);
      left += sides[c].left + width + sides[c].right + kGap;
      plan.frames.push_back(frames[r][c]);
    }
    top -= room_above(row) + height + room_below(row);
  }
  return plan;
}

void draw_chart_frame(Canvas& canvas, const ChartFrame& frame) {
  draw_frame(canvas, frame.view(), "", frame.x.tics_below(frame.box.width),
             frame.numbered ? frame.y.tics(frame.box.height) : Tics());
  draw_labels(canvas, frame, frame.heading_height);
}

void draw_reference_lines(Canvas& canvas, const ChartFrame& frame) {
  for (const ReferenceLine& line : frame.panel->reference_lines) {
    const double place = frame.y.place(line.y);
    if (place < frame.y.range().low || place > frame.y.range().high) continue;
    const Interval& x = frame.x.range();
    const Points ends = frame.pixels((Points(2, 2) << x.low, x.high, place, place).finished());
    canvas.lines({ends}, {colour::kReference, 1.3});
    if (!line.label.empty())
      canvas.text(ends(0, 1) + kReferenceGap, ends(1, 1), line.label, kLabelSize, colour::kTicText);
  }
}

}  // namespace pulson::picture
