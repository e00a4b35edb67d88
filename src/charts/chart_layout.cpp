#include "chart_layout.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

namespace pulson::charts {
namespace {

constexpr double kBelowAnyLogarithm = -1000;
constexpr double kDecadeTicDistance = 34;  // at the left; below, numbers need twice as much
constexpr double kDividedDecade = 130;     // pixels, from which on a decade has tics at 2 and 5 as well
constexpr double kPlainDecades = 4.5;      // numbers up to this many decades from 1 are written without powers
constexpr double kNamePart = 0.94;         // of the distance between names, that one may take
constexpr double kFewDecades = 1.2;        // up to which tics lie at even steps of the values

// Pixels between tics: small panels have fewer of them, large ones more, but neither in proportion.
double distance_at_left(double pixels) { return std::clamp(pixels / 7, 45.0, 60.0); }
double distance_below(double pixels) { return std::clamp(pixels / 6, 75.0, 100.0); }

std::string text_of(double multiple, int exponent, bool plain) {
  if (plain) return fmt::format("{:g}", multiple * std::pow(10.0, exponent));
  return multiple == 1 ? draw::power_of_ten(exponent) : fmt::format("{:g}·{}", multiple, draw::power_of_ten(exponent));
}

/// Tics at even steps of the values, that are so far apart as asked for even at the upper end, where they are densest.
draw::Tics make_tics_of_values(const draw::Interval& range, double pixels, double distance) {
  const draw::Interval values{std::pow(10.0, range.low), std::pow(10.0, range.high)};
  const double density = values.high * std::numbers::ln10 * range.span() / values.span();
  draw::Tics tics = make_tics(values, pixels, distance * density);
  for (double& value : tics.values) value = std::log10(value);
  return tics;
}

draw::Tics make_logarithmic_tics(const draw::Interval& range, double pixels, double distance) {
  const double decade = pixels / range.span();
  const bool plain = std::max(std::abs(range.low), std::abs(range.high)) < kPlainDecades;
  const int step = static_cast<int>(std::ceil(distance / decade));
  draw::Tics tics;
  const auto add = [&](double multiple, int exponent) {
    const double place = exponent + std::log10(multiple);
    if (place < range.low || place > range.high) return;
    tics.values.push_back(place);
    tics.texts.push_back(text_of(multiple, exponent, plain));
  };
  for (int exponent = static_cast<int>(std::floor(range.low)); exponent <= range.high; ++exponent) {
    if (exponent % step == 0) add(1, exponent);
    if (decade < kDividedDecade) continue;
    add(2, exponent);
    add(5, exponent);
  }
  const bool too_few = tics.values.size() < (range.span() < kFewDecades ? 3 : 2);
  return too_few ? make_tics_of_values(range, pixels, distance) : tics;
}

/// Those at whole numbers.
draw::Tics whole_tics(const draw::Tics& tics) {
  draw::Tics whole;
  for (const double value : tics.values) {
    if (std::abs(value - std::round(value)) > 1e-6) continue;
    whole.values.push_back(std::round(value));
    whole.texts.push_back(fmt::format("{:.0f}", std::round(value)));
  }
  return whole;
}

constexpr double kBarPart = 0.8;      // of the distance between neighbouring x, that all bars there take
constexpr double kLoneBarPart = 0.3;  // the same where there is one place alone
constexpr double kLoneBar = 1;        // that distance where there is one x alone

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

constexpr double kLabelSize = 18;
constexpr double kYLabelRoom = 26;  // between heading and panel
constexpr double kXLabelRoom = 28;  // below the numbers
constexpr double kNoHeading = 18;   // above a panel that has none
constexpr double kNumbers = 70;     // first guess of those at the left
constexpr double kReferenceGap = 9, kWidestReference = 200;
constexpr double kNumberGap = 18;   // between numbers of neighbouring panels
constexpr double kFlatness = 0.66;  // height of a panel by its width
constexpr double kTallest = 560;
constexpr double kTallestOfSeveral = 430;
constexpr double kShortest = 240;
constexpr double kTallestChart = 1560;

using Row = std::vector<ChartPanel>;
using FrameRow = std::vector<ChartFrame>;

bool any_in(const FrameRow& row, std::string ChartPanel::*text) {
  return std::any_of(row.begin(), row.end(), [text](const ChartFrame& frame) { return !(frame.panel->*text).empty(); });
}

double y_label_room(const FrameRow& row) { return any_in(row, &ChartPanel::y_label) ? kYLabelRoom : 0; }

double room_above(const FrameRow& row) {
  return (any_in(row, &ChartPanel::heading) ? draw::kHeading : kNoHeading) + y_label_room(row);
}

double room_below(const FrameRow& row) {
  return draw::kTicRoom + (any_in(row, &ChartPanel::x_label) ? kXLabelRoom : 0);
}

double reference_room(const ChartPanel& panel) {
  double room = 0;
  for (const ReferenceLine& line : panel.reference_lines)
    if (!line.label.empty())
      room = std::max(room, kReferenceGap + std::min(kWidestReference, draw::number_width(line.label)));
  return room;
}

std::size_t count_columns(const std::vector<FrameRow>& rows) {
  std::size_t columns = 0;
  for (const FrameRow& row : rows) columns = std::max(columns, row.size());
  return columns;
}

bool have_alike_axes(const ChartPanel& one, const ChartPanel& other) {
  return one.x_names.empty() == other.x_names.empty() && one.log_x == other.log_x;
}

/// The horizontal axis of a panel in that column, which it shares with those of its kind there.
ChartAxis shared_horizontal_axis(const Chart& chart, std::size_t column, const ChartPanel& panel) {
  std::vector<const ChartPanel*> alike;
  for (const Row& row : chart.rows)
    if (column < row.size() && have_alike_axes(row[column], panel)) alike.push_back(&row[column]);
  return horizontal_axis(alike);
}

/// Whether no other panel of that column shares its horizontal axis: then it may be wider than the column.
bool has_axis_of_its_own(const Chart& chart, std::size_t column, const ChartPanel& panel) {
  return std::count_if(chart.rows.begin(), chart.rows.end(),
                       [&](const Row& row) { return column < row.size() && have_alike_axes(row[column], panel); }) == 1;
}

/// The frames of the chart with their axes, but without their boxes; [row][column].
std::vector<FrameRow> make_frames(const Chart& chart) {
  std::vector<FrameRow> frames;
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

/// The same in one column, each with its numbers.
std::vector<FrameRow> one_above_the_other(const std::vector<FrameRow>& rows) {
  std::vector<FrameRow> column;
  for (const FrameRow& row : rows)
    for (const ChartFrame& frame : row) {
      column.push_back({frame});
      column.back().front().numbered = true;
    }
  return column;
}

/// Room of one column besides its panels.
struct Sides {
  double left = 0;
  double right = 0;
};

std::vector<Sides> sides_of(const std::vector<FrameRow>& frames, double width, double height) {
  const std::size_t columns = count_columns(frames);
  std::vector<Sides> sides(columns);
  for (const auto& row : frames)
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (row[c].numbered) sides[c].left = std::max(sides[c].left, left_number_width(row[c].y.tics(height)));
      sides[c].right = std::max(sides[c].right, reference_room(*row[c].panel));
      if (c == 0) continue;
      double widest = 0;  // of the numbers below, which reach into the gap from both sides
      for (const std::string& text : row[c].x.tics_below(width / static_cast<double>(columns) - kNumbers).texts)
        widest = std::max(widest, draw::number_width(text));
      sides[c].left = std::max(sides[c].left, widest + kNumberGap - draw::kGap);
    }
  return sides;
}

double panel_height(const std::vector<FrameRow>& frames, double whole_width, double fixed_heights) {
  const auto rows = static_cast<double>(frames.size()), columns = static_cast<double>(count_columns(frames));
  const double width = (whole_width - 2 * draw::kEdge - columns * kNumbers) / columns;
  const double height = std::min(kFlatness * width, rows > 1 ? kTallestOfSeveral : kTallest);
  return std::round(std::max(kShortest, std::min(height, (kTallestChart - fixed_heights) / rows)));
}

void draw_labels(draw::Canvas& canvas, const ChartFrame& frame, double heading_height) {
  const ChartPanel& panel = *frame.panel;
  const draw::Box& box = frame.box;
  if (!panel.heading.empty()) draw_heading(canvas, box, panel.heading, heading_height);
  if (!panel.y_label.empty())
    canvas.text(box.left, box.bottom + box.height + 17, panel.y_label, kLabelSize, draw::colour::kText,
                draw::Align::kLeft, box.width);
  if (!panel.x_label.empty())
    canvas.text(box.left + box.width / 2, box.bottom - draw::kTicRoom - kXLabelRoom / 2 + 4, panel.x_label, kLabelSize,
                draw::colour::kText, draw::Align::kCentre, box.width);
}

}  // namespace

ChartAxis::ChartAxis(const std::vector<double>& values, bool logarithmic)
    : logarithmic_(logarithmic), range_{INFINITY, -INFINITY} {
  for (const double value : values)
    if (!logarithmic || value > 0) range_ = range_.joined({place(value), place(value)});
  if (!(range_.low <= range_.high)) range_ = {0, 1};
}

void ChartAxis::add_margins(bool keeps_zero) {
  const bool stands_on_zero = keeps_zero && !logarithmic_ && range_.low == 0;
  range_ = draw::with_margins({range_}, 1).front();
  if (stands_on_zero) range_.low = 0;
}

double ChartAxis::place(double value) const {
  if (!logarithmic_) return value;
  return value > 0 ? std::log10(value) : kBelowAnyLogarithm;
}

Eigen::RowVectorXd ChartAxis::places(const std::vector<double>& values) const {
  Eigen::RowVectorXd result(static_cast<Eigen::Index>(values.size()));
  std::transform(values.begin(), values.end(), result.begin(), [this](double value) { return place(value); });
  return result;
}

draw::Tics ChartAxis::tics(double pixels) const {
  return logarithmic_ ? make_logarithmic_tics(range_, pixels, kDecadeTicDistance)
                      : make_tics(range_, pixels, distance_at_left(pixels));
}

draw::Tics ChartAxis::tics_at_names(double pixels) const {
  const double room = kNamePart * pixels / range_.span();
  draw::Tics tics;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    tics.values.push_back(place(static_cast<double>(i + 1)));
    tics.texts.push_back(draw::number_width(names_[i]) <= room ? names_[i] : "");
  }
  return tics;
}

draw::Tics ChartAxis::tics_below(double pixels) const {
  if (!names_.empty()) return tics_at_names(pixels);
  if (logarithmic_) return make_logarithmic_tics(range_, pixels, 2 * kDecadeTicDistance);
  draw::Tics tics = make_tics_below(range_, pixels, distance_below(pixels));
  return counts_ ? whole_tics(tics) : tics;
}

double bar_width(const ChartPanel& panel, const ChartAxis& x) {
  const auto abreast = std::count_if(panel.series.begin(), panel.series.end(), is_bars);
  const double part = panel.x_names.size() == 1 ? kLoneBarPart : kBarPart;
  return part * bar_distance(panel, x) / std::max(static_cast<double>(abreast), 1.0);
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
  if (std::all_of(column.begin(), column.end(), [](const ChartPanel* panel) { return panel->counts_x; }))
    axis.set_counts();
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

ChartPlan plan_chart(const Chart& chart, double legend_height, bool narrow) {
  const draw::Titles titles = narrow ? draw::Titles() : draw::Titles{chart.title, chart.subtitle};
  const double whole_width = narrow ? draw::kNarrowWidth : draw::kWidth;
  std::vector<FrameRow> frames = make_frames(chart);
  if (narrow) frames = one_above_the_other(frames);
  double fixed_heights = legend_height;
  for (const FrameRow& row : frames) fixed_heights += room_above(row) + room_below(row);
  const double height = panel_height(frames, whole_width, title_height(titles) + fixed_heights);

  const std::size_t columns = count_columns(frames);
  const std::vector<Sides> sides = sides_of(frames, whole_width, height);
  double free = whole_width - 2 * draw::kEdge - draw::kGap * (static_cast<double>(columns) - 1);
  for (const Sides& side : sides) free -= side.left + side.right;
  const double width = free / static_cast<double>(columns);

  double top = fixed_heights + height * static_cast<double>(frames.size());
  ChartPlan plan{titled_canvas(titles, draw::kEdge + sides.front().left, whole_width, top), {}};
  for (FrameRow& row : frames) {
    double left = draw::kEdge;
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c].box = {left + sides[c].left, top - room_above(row) - height, width, height};
      if (c + 1 == row.size() && c + 1 < columns && has_axis_of_its_own(chart, c, *row[c].panel))
        row[c].box.width = whole_width - draw::kEdge - sides.back().right - row[c].box.left;
      row[c].heading_height = draw::kHeadingHeight + y_label_room(row);
      left += sides[c].left + width + sides[c].right + draw::kGap;
      plan.frames.push_back(row[c]);
    }
    top -= room_above(row) + height + room_below(row);
  }
  return plan;
}

void draw_chart_frame(draw::Canvas& canvas, const ChartFrame& frame) {
  draw_frame(canvas, frame.view(), "", frame.x.tics_below(frame.box.width),
             frame.numbered ? frame.y.tics(frame.box.height) : draw::Tics());
  draw_labels(canvas, frame, frame.heading_height);
}

void draw_reference_lines(draw::Canvas& canvas, const ChartFrame& frame) {
  for (const ReferenceLine& line : frame.panel->reference_lines) {
    const double place = frame.y.place(line.y);
    if (place < frame.y.range().low || place > frame.y.range().high) continue;
    const draw::Interval& x = frame.x.range();
    const Points ends = frame.pixels((Points(2, 2) << x.low, x.high, place, place).finished());
    canvas.lines({ends}, {draw::colour::kReference, 1.3});
    if (!line.label.empty())
      canvas.text(ends(0, 1) + kReferenceGap, ends(1, 1), line.label, kLabelSize, draw::colour::kTicText,
                  draw::Align::kLeft, kWidestReference);
  }
}

}  // namespace pulson::charts
