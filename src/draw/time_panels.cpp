#include "time_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "draw/thinning.hpp"
#include "layout.hpp"

namespace pulson::picture {
namespace {

constexpr double kMostLinearDecades = 4;
constexpr double kSmallQuantile = 0.05;
constexpr double kValueTicDistance = 60;
constexpr double kTimeNumberGap = 18;  // between numbers of neighbouring panels
constexpr double kDecadeDistance = 32;
constexpr std::array<int, 10> kDecadeSteps = {1, 2, 3, 5, 10, 20, 30, 50, 100, 200};

std::vector<const Curve*> all_curves(const TimeRow& row) {
  std::vector<const Curve*> curves;
  for (const auto& column : row.columns)
    for (const Curve& curve : column) curves.push_back(&curve);
  return curves;
}

Interval range_of_curves(const std::vector<const Curve*>& curves, int row) {
  std::vector<const Points*> sets;
  for (const Curve* curve : curves) sets.push_back(&curve->points);
  return range_of(sets, row);
}

/// The largest size of a value in each piece of the time; without zeros.
std::vector<double> sizes_over_time(const std::vector<const Curve*>& curves) {
  constexpr double kPieces = 400;
  const Interval times = range_of_curves(curves, 0);
  std::vector<double> sizes(static_cast<std::size_t>(kPieces) + 1, 0);
  for (const Curve* curve : curves)
    for (const auto& vertex : curve->points.colwise()) {
      double& size = sizes[static_cast<std::size_t>((vertex[0] - times.low) / times.span() * kPieces)];
      size = std::max(size, std::abs(vertex[1]));
    }
  sizes.erase(std::remove(sizes.begin(), sizes.end(), 0.0), sizes.end());
  return sizes;
}

/// The threshold of a symmetric logarithmic scale, 0 where a linear one will do.
double threshold_of(const std::vector<const Curve*>& curves) {
  std::vector<double> sizes = sizes_over_time(curves);
  if (sizes.empty()) return 0;
  std::sort(sizes.begin(), sizes.end());
  const double small = std::log10(sizes[static_cast<std::size_t>(kSmallQuantile * static_cast<double>(sizes.size()))]);
  return std::log10(sizes.back()) - small > kMostLinearDecades ? std::pow(10.0, std::floor(small)) : 0;
}

}  // namespace

Points values_over_time(const std::vector<Points>& trajectory, const std::vector<double>& times, int landmark, int row,
                        const std::vector<std::size_t>& indices) {
  Points points(2, static_cast<Eigen::Index>(indices.size()));
  Eigen::Index column = 0;
  for (const std::size_t k : indices) points.col(column++) << times[k], trajectory[k](row, landmark);
  return points;
}

ValueAxis::ValueAxis(const std::vector<const Curve*>& curves) : threshold_(threshold_of(curves)), range_() {
  const Interval values = range_of_curves(curves, 1);
  range_ = with_margins({{place(values.low), place(values.high)}}, 1).front();
}

double ValueAxis::place(double value) const {
  return is_logarithmic() ? std::asinh(value / threshold_ / 2) / std::numbers::ln10 : value;
}

Tics ValueAxis::tics(double pixels) const {
  if (!is_logarithmic()) return make_tics(range_, pixels, kValueTicDistance);
  const double decade = pixels / range_.span();
  const int first = static_cast<int>(std::lround(std::log10(threshold_)));
  const auto* const wide = std::find_if(kDecadeSteps.begin(), kDecadeSteps.end() - 1,
                                        [&](int step) { return step * decade >= kDecadeDistance; });

  Tics tics;
  const auto add = [&](double place, const std::string& text) {
    if (place < range_.low || place > range_.high) return;
    tics.values.push_back(place);
    tics.texts.push_back(text);
  };
  add(0, "0");
  for (int exponent = first + 1; exponent - first <= std::max(-range_.low, range_.high); ++exponent) {
    const double distance = place(std::pow(10.0, exponent));
    if (exponent % *wide != 0 || distance * decade < kDecadeDistance) continue;
    add(distance, power_of_ten(exponent, false));
    add(-distance, power_of_ten(exponent, true));
  }
  return tics;
}

TimePanels::TimePanels(TimeRow row)
    : row_(std::move(row)), axis_(all_curves(row_)), times_(range_of_curves(all_curves(row_), 0)) {}

void TimePanels::draw_curves(Canvas& canvas, const View& view, const std::vector<Curve>& curves) const {
  std::vector<Points> faint, full;
  for (const Curve& curve : curves) {
    Points points = curve.points;
    for (double& value : points.row(1)) value = axis_.place(value);
    (curve.faint ? faint : full).push_back(view.pixels(points));
  }
  const std::size_t most = row_.vertices / row_.columns.size();
  simplify_lines(full, faint.empty() ? most : most / 2);
  std::size_t used = 0;
  for (const Points& line : full) used += static_cast<std::size_t>(line.cols());
  simplify_lines(faint, most - std::min(used, most));
  auto next_faint = faint.begin(), next_full = full.begin();
  for (const Curve& curve : curves) canvas.lines({curve.faint ? *next_faint++ : *next_full++}, curve.stroke);
}

void TimePanels::draw(Canvas& canvas, const Box& box) const {
  const auto columns = static_cast<double>(row_.columns.size());
  double gap = kGap;  // or more, so that numbers of neighbours stay apart
  for (const std::string& text : make_tics_below(times_, box.width / columns - kGap).texts)
    gap = std::max(gap, number_width(text) + kTimeNumberGap);
  View view{{box.left, box.bottom, (box.width - (columns - 1) * gap) / columns, box.height}, times_, axis_.range()};
  const Tics y_tics = axis_.tics(box.height);
  for (std::size_t i = 0; i < row_.columns.size(); ++i) {
    const std::string scale = axis_.is_logarithmic() ? ", symmetric log scale" : "";
    if (row_.zero_line && view.y.low < 0 && view.y.high > 0)
      canvas.lines({view.pixels((Points(2, 2) << times_.low, times_.high, 0, 0).finished())}, {colour::kFrame, 1.4});
    draw_curves(canvas, view, row_.columns[i]);
    draw_frame(canvas, view, row_.headings[i] + scale, make_tics_below(view.x, view.box.width),
               i == 0 ? y_tics : Tics());
    view.box.left += view.box.width + gap;
  }
}

}  // namespace pulson::picture
