#include <algorithm>
#include <cmath>

#include "chart_layout.hpp"
#include "chart_strokes.hpp"
#include "draw/checks.hpp"

namespace pulson::charts {
namespace {

constexpr double kDotRoom = 0.3;  // radius of a dot, in distances between neighbours

/// Draws one series within the frame of its panel.
class SeriesMarks {
 public:
  SeriesMarks(draw::Canvas& canvas, const ChartFrame& frame, const Series& series, const draw::SeriesLook& look)
      : canvas_(canvas), frame_(frame), series_(series), look_(look), colour_(look.colour) {}

  /// Bars are moved aside by so many places.
  void set_bars(double width, double aside) {
    bar_width_ = width;
    aside_ = aside;
  }

  void draw_areas(std::size_t vertices) {
    if (!series_.low.empty()) {
      std::vector<Points> borders{pixels(centres(), series_.low), pixels(centres(), series_.high)};
      for (Points& border : borders) simplify(border, vertices);
      canvas_.areas({between(borders[0], borders[1])}, draw::faded(colour_, kBandFade));
    }
    if (series_.style == SeriesStyle::kSteps && !series_.y.empty())
      canvas_.areas({steps()}, draw::faded(colour_, kStepFade));
    if (series_.style == SeriesStyle::kBars) canvas_.areas(bars(), draw::faded(colour_, kBarFade));
  }

  void draw_lines(std::size_t vertices) {
    if (series_.style == SeriesStyle::kSteps) stroke(steps(), kSideWidth, {}, vertices);
    if (series_.style == SeriesStyle::kBars)
      for (const Points& bar : bars()) stroke(bar, kSideWidth, {}, vertices);
    if (!has_line()) return;
    stroke(pixels(centres(), series_.y), is_dense(series_) ? kDenseLineWidth : kLineWidth, dashes(), vertices);
  }

  /// Each with small ends.
  void draw_errors() {
    std::vector<Points> lines;
    const double cap = std::min(kMostCap, kDotRoom * typical_distance());
    for (std::size_t i = 0; i < series_.error.size(); ++i) {
      if (series_.error[i] == 0) continue;
      const std::vector<double> ends{series_.y[i] - series_.error[i], series_.y[i] + series_.error[i]};
      const Eigen::RowVectorXd place = Eigen::RowVectorXd::Constant(2, centres()[static_cast<Eigen::Index>(i)]);
      const Points bar = pixels(place, ends);
      lines.push_back(bar);
      for (const int end : {0, 1})
        lines.push_back((Points(2, 2) << bar(0, end) - cap, bar(0, end) + cap, bar(1, end), bar(1, end)).finished());
    }
    canvas_.lines(lines, {colour_, kErrorWidth});
  }

  /// The dots, or the white margins that set them off from what lies below.
  void draw_dots(bool margins) {
    const bool lone = has_line() && series_.y.size() == 1;  // it would be invisible
    if (series_.style != SeriesStyle::kPoints && series_.style != SeriesStyle::kLineAndPoints && !lone) return;
    const Points all = pixels(centres(), series_.y);
    std::vector<Eigen::Index> within;
    for (Eigen::Index i = 0; i < all.cols(); ++i)
      if (is_within(all(1, i))) within.push_back(i);
    const double most = series_.error.empty() ? kMostDot : kMostDotWithError;
    const double radius = std::clamp(kDotRoom * typical_distance(), kLeastDot, most);
    if (margins && radius <= 2 * kDotMargin) return;  // too close to be set off
    canvas_.look_through({});                         // whole at the frame, too
    const draw::SeriesLook look = margins ? draw::SeriesLook{draw::colour::kPaper, look_.place} : look_;
    draw_marks(canvas_, all(Eigen::all, within), radius + (margins ? kDotMargin : 0), look);
    canvas_.look_through(frame_.window());
  }

 private:
  bool has_line() const { return series_.style == SeriesStyle::kLine || series_.style == SeriesStyle::kLineAndPoints; }

  std::span<const double> dashes() const {
    if (series_.dashed) return kDashed;
    return is_dense(series_) ? std::span<const double>() : dashes_at(look_.place);
  }

  bool is_within(double height) const { return height >= frame_.heights().low && height <= frame_.heights().high; }

  /// The places of the values: of a histogram, the middles of its bins.
  Eigen::RowVectorXd centres() const {
    Eigen::RowVectorXd x = frame_.x.places(series_.x);
    if (series_.style != SeriesStyle::kSteps) return x.array() + aside_;
    if (x.size() == 0) return x;
    return (x.head(x.size() - 1) + x.tail(x.size() - 1)) / 2;
  }

  Points pixels(const Eigen::RowVectorXd& places, const std::vector<double>& values) const {
    Points points(2, places.size());
    points << places, frame_.y.places(values);
    return near(frame_.pixels(points));
  }

  /// No farther away than squares of distances allow.
  static Points near(const Points& points) {
    constexpr double kFarAway = 1e5;  // pixels
    return points.cwiseMax(-kFarAway).cwiseMin(kFarAway);
  }

  static void simplify(Points& line, std::size_t vertices) {
    std::vector<Points> lines{std::move(line)};
    draw::simplify_lines(lines, vertices);
    line = std::move(lines.front());
  }

  static Points between(const Points& low, const Points& high) {
    Points outline(2, low.cols() + high.cols());
    outline << low, high.rowwise().reverse();
    return outline;
  }

  /// The outline of a histogram's area, from its foot to its foot.
  Points steps() const {
    const auto bins = static_cast<Eigen::Index>(series_.y.size());
    const Eigen::RowVectorXd edges = frame_.x.places(series_.x), heights = frame_.y.places(series_.y);
    Points outline(2, bins == 0 ? 0 : 2 * bins + 2);
    if (bins == 0) return outline;
    outline.col(0) << edges[0], frame_.y.base();
    for (Eigen::Index i = 0; i < bins; ++i) {
      outline.col(2 * i + 1) << edges[i], heights[i];
      outline.col(2 * i + 2) << edges[i + 1], heights[i];
    }
    outline.rightCols(1) << edges[bins], frame_.y.base();
    return near(frame_.pixels(outline));
  }

  std::vector<Points> bars() const {
    std::vector<Points> bars;
    const Eigen::RowVectorXd x = centres(), heights = frame_.y.places(series_.y);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const double left = x[i] - bar_width_ / 2, right = x[i] + bar_width_ / 2, base = frame_.y.base();
      bars.push_back(near(
          frame_.pixels((Points(2, 4) << left, left, right, right, base, heights[i], heights[i], base).finished())));
    }
    return bars;
  }

  void stroke(Points line, double width, std::span<const double> pattern, std::size_t vertices) {
    simplify(line, vertices);
    canvas_.lines({std::move(line)}, {colour_, width, pattern});
  }

  /// Median of the pixels between neighbouring values, infinite where there is one alone.
  double typical_distance() const {
    const Points points = pixels(centres(), series_.y);
    std::vector<double> distances;
    for (Eigen::Index i = 0; i + 1 < points.cols(); ++i)
      distances.push_back((points.col(i + 1) - points.col(i)).norm());
    return distances.empty() ? INFINITY : draw::median(std::move(distances));
  }

  draw::Canvas& canvas_;
  const ChartFrame& frame_;
  const Series& series_;
  const draw::SeriesLook& look_;
  const draw::Colour& colour_;
  double bar_width_ = 0;
  double aside_ = 0;
};

}  // namespace

std::span<const double> dashes_at(std::size_t place) {
  static constexpr std::array<double, 2> kLong = {16, 6}, kShort = {6, 5}, kDots = {2.5, 5};
  static constexpr std::array<double, 4> kDashDot = {14, 5, 2.5, 5}, kTwoDashes = {14, 4, 6, 4};
  constexpr std::array<std::span<const double>, 6> kPatterns = {{{}, kLong, kDashDot, kShort, kTwoDashes, kDots}};
  return kPatterns.at(place % kPatterns.size());
}

bool is_dense(const Series& series) {
  constexpr std::size_t kMostVertices = 1000;
  return series.y.size() > kMostVertices;
}

void draw_all_series(draw::Canvas& canvas, const ChartFrame& frame, const std::vector<draw::SeriesLook>& looks,
                     std::size_t vertices) {
  const std::vector<Series>& all = frame.panel->series;
  const auto is_bars = [](const Series& series) { return series.style == SeriesStyle::kBars; };
  const double width = bar_width(*frame.panel, frame.x);
  double aside = -width * (static_cast<double>(std::count_if(all.begin(), all.end(), is_bars)) - 1) / 2;
  std::vector<SeriesMarks> marks;
  for (std::size_t i = 0; i < all.size(); ++i) {
    marks.emplace_back(canvas, frame, all[i], looks[i]);
    if (!is_bars(all[i])) continue;
    marks.back().set_bars(width, aside);
    aside += width;
  }
  canvas.look_through(frame.window());
  for (SeriesMarks& one : marks) one.draw_areas(vertices);
  for (SeriesMarks& one : marks) {
    one.draw_lines(vertices);
    one.draw_dots(true);
    one.draw_errors();
    one.draw_dots(false);
  }
  canvas.look_through({});
}

}  // namespace pulson::charts
