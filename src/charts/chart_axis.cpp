#include "chart_axis.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

#include "draw/layout.hpp"

namespace pulson::picture {
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
  return multiple == 1 ? power_of_ten(exponent) : fmt::format("{:g}·{}", multiple, power_of_ten(exponent));
}

/// Tics at even steps of the values, that are so far apart as asked for even at the upper end, where they are densest.
Tics make_tics_of_values(const Interval& range, double pixels, double distance) {
  const Interval values{std::pow(10.0, range.low), std::pow(10.0, range.high)};
  const double density = values.high * std::numbers::ln10 * range.span() / values.span();
  Tics tics = make_tics(values, pixels, distance * density);
  for (double& value : tics.values) value = std::log10(value);
  return tics;
}

Tics make_logarithmic_tics(const Interval& range, double pixels, double distance) {
  const double decade = pixels / range.span();
  const bool plain = std::max(std::abs(range.low), std::abs(range.high)) < kPlainDecades;
  const int step = static_cast<int>(std::ceil(distance / decade));
  Tics tics;
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

}  // namespace

ChartAxis::ChartAxis(const std::vector<double>& values, bool logarithmic)
    : logarithmic_(logarithmic), range_{INFINITY, -INFINITY} {
  for (const double value : values)
    if (!logarithmic || value > 0) range_ = range_.joined({place(value), place(value)});
  if (!(range_.low <= range_.high)) range_ = {0, 1};
}

void ChartAxis::add_margins(bool keeps_zero) {
  const bool stands_on_zero = keeps_zero && !logarithmic_ && range_.low == 0;
  range_ = with_margins({range_}, 1).front();
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

Tics ChartAxis::tics(double pixels) const {
  return logarithmic_ ? make_logarithmic_tics(range_, pixels, kDecadeTicDistance)
                      : make_tics(range_, pixels, distance_at_left(pixels));
}

Tics ChartAxis::tics_at_names(double pixels) const {
  const double room = kNamePart * pixels / range_.span();
  Tics tics;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    tics.values.push_back(place(static_cast<double>(i + 1)));
    tics.texts.push_back(number_width(names_[i]) <= room ? names_[i] : "");
  }
  return tics;
}

Tics ChartAxis::tics_below(double pixels) const {
  if (!names_.empty()) return tics_at_names(pixels);
  return logarithmic_ ? make_logarithmic_tics(range_, pixels, 2 * kDecadeTicDistance)
                      : make_tics_below(range_, pixels, distance_below(pixels));
}

namespace {

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

}  // namespace

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
