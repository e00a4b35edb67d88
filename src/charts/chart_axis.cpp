#include "chart_axis.hpp"

#include <algorithm>
#include <cmath>
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

}  // namespace pulson::picture
