#include "path_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "draw/checks.hpp"

namespace pulson::draw {
namespace {

constexpr double kMostLinearDecades = 4, kSmallQuantile = 0.05;
constexpr double kTimeNumberGap = 18;  // between numbers of neighbouring panels
constexpr double kValueTicDistance = 60, kDecadeDistance = 32;
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

// An SVG takes some 16 bytes for a vertex.
constexpr std::size_t kVertices = 30000;          // of one row of panels
constexpr double kVerticesPerPixel = 1.5;         // of one curve
constexpr std::size_t kVerticesInHand = 2000000;  // of all curves, before they are simplified
constexpr std::size_t kMostCurves = 500;          // in one panel
constexpr std::size_t kMostLandmarks = 250;       // in one panel
constexpr std::size_t kLongestLabel = 12;         // bytes
constexpr std::size_t kMostNamed = 8;             // landmarks in the legend

/// "q₁, p₁" for the first landmark.
std::string symbols_of(std::size_t landmark) {
  constexpr std::array<std::string_view, 10> kLowered = {"₀", "₁", "₂", "₃", "₄", "₅", "₆", "₇", "₈", "₉"};
  std::string number;
  for (const char digit : std::to_string(landmark + 1)) number += kLowered.at(static_cast<std::size_t>(digit - '0'));
  return "q" + number + ", p" + number;
}

/// The labels where there is one for each landmark and none is long, else symbols.
std::vector<std::string> names_of(const Landmarks& shape) {
  const auto fits = [](const std::string& label) { return !label.empty() && label.size() <= kLongestLabel; };
  const auto n = static_cast<std::size_t>(shape.count());
  if (shape.labels.size() == n && std::all_of(shape.labels.begin(), shape.labels.end(), fits)) return shape.labels;
  std::vector<std::string> names;
  for (std::size_t a = 0; a < n; ++a) names.push_back(symbols_of(a));
  return names;
}

/// Momenta or positions over time, as far as panels show them.
struct Selection {
  const PathPicture& picture;
  const std::vector<std::vector<Points>>& paths;
  std::vector<int> landmarks;
  std::size_t path_count;       // the first ones
  std::size_t vertices;         // of one curve, before it is simplified
  std::vector<Colour> colours;  // of all landmarks

  Selection(const PathPicture& all, bool momenta, std::size_t columns);
};

Selection::Selection(const PathPicture& all, bool momenta, std::size_t columns)
    : picture(all), paths(momenta ? all.momenta : all.positions), colours(landmark_colours(all)) {
  for (const std::size_t a : spread_indices(static_cast<std::size_t>(all.start.count()), kMostLandmarks))
    landmarks.push_back(static_cast<int>(a));
  path_count = std::min(paths.size(), std::max<std::size_t>(1, kMostCurves / landmarks.size()));
  const auto seen = static_cast<std::size_t>(kVerticesPerPixel * kWidth) / columns;
  vertices = std::min(seen, kVerticesInHand / (landmarks.size() * path_count));
}

/// The curves of one panel: coordinate `row` of the landmarks on the paths `first`, …, `last` − 1. Where these are
/// several, the first is drawn in full and above the others.
std::vector<Curve> curves_of(const Selection& shown, std::size_t first, std::size_t last, int row) {
  const std::vector<double>& times = shown.picture.times;
  const double width = shown.landmarks.size() <= kMostNamed ? 1.8 : 1.2;
  const double transparency = 1 - opacity(last - first - 1);
  std::vector<Curve> curves;
  for (std::size_t m = last; m-- > first;) {
    const auto kept = thin_paths(shown.paths[m], shown.landmarks, times, shown.vertices);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const Colour& own = shown.colours[static_cast<std::size_t>(shown.landmarks[i])];
      const Stroke stroke = m == first ? Stroke{own, width} : Stroke{faded(own, transparency), 1.1};
      curves.push_back({values_over_time(shown.paths[m], times, shown.landmarks[i], row, kept[i]), stroke});
    }
  }
  return curves;
}

/// What a heading says where not all is shown in the same way; may be empty.
std::string remark(const Selection& shown, bool several_paths) {
  std::string text;
  if (const auto all = static_cast<std::size_t>(shown.picture.start.count()); shown.landmarks.size() < all)
    text += ", " + some_of(shown.landmarks.size(), all, "landmarks");
  if (several_paths && shown.path_count > 1)
    text += ", path 1 and faintly " + some_of(shown.path_count - 1, shown.paths.size() - 1, "others");
  return text;
}

constexpr double kFarthest = 6;  // in 90 % quantiles

/// The largest coordinate, in size, of any of the points as seen from the centre.
double distance(const Points& points, const Eigen::VectorXd& centre) {
  return (points.colwise() - centre).cwiseAbs().maxCoeff();
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

double TimePanels::height_of(double panel) const {
  const auto rows = row_.stacked ? static_cast<double>(row_.columns.size()) : 1;
  return rows * panel + (rows - 1) * (kHeading + kTicRoom);
}

void TimePanels::draw(Canvas& canvas, const Box& box) const {
  const double columns = row_.stacked ? 1 : static_cast<double>(row_.columns.size());
  const double rows = row_.stacked ? static_cast<double>(row_.columns.size()) : 1;
  const double height = (box.height - (rows - 1) * (kHeading + kTicRoom)) / rows;
  double gap = kGap;  // or more, so that numbers of neighbours do not overlap
  for (const std::string& text : make_tics_below(times_, box.width / columns - kGap).texts)
    gap = std::max(gap, number_width(text) + kTimeNumberGap);
  View view{{box.left, box.top() - height, (box.width - (columns - 1) * gap) / columns, height}, times_, axis_.range()};
  const Tics y_tics = axis_.tics(height);
  for (std::size_t i = 0; i < row_.columns.size(); ++i) {
    const std::string scale = axis_.is_logarithmic() ? ", symmetric log scale" : "";
    if (row_.zero_line && view.y.low < 0 && view.y.high > 0)
      canvas.lines({view.pixels((Points(2, 2) << times_.low, times_.high, 0, 0).finished())}, {colour::kFrame, 1.4});
    std::vector<Points> lines;
    for (const Curve& curve : row_.columns[i]) {
      Points points = curve.points;
      for (double& value : points.row(1)) value = axis_.place(value);
      lines.push_back(view.pixels(points));
    }
    simplify_lines(lines, row_.vertices / row_.columns.size());
    for (std::size_t c = 0; c < lines.size(); ++c) canvas.lines({std::move(lines[c])}, row_.columns[i][c].stroke);
    draw_frame(canvas, view, row_.headings[i] + scale, make_tics_below(view.x, view.box.width),
               i == 0 || row_.stacked ? y_tics : Tics());
    if (row_.stacked)
      view.box.bottom -= height + kHeading + kTicRoom;
    else
      view.box.left += view.box.width + gap;
  }
}

double opacity(std::size_t count) { return std::clamp(1.6 / std::sqrt(static_cast<double>(count)), 0.13, 0.75); }

std::vector<Colour> landmark_colours(const PathPicture& picture) {
  if (picture.start.dimension() == 1) return colours_by_position(picture.start.points);
  std::vector<Colour> colours;
  for (int a = 0; a < picture.start.count(); ++a) colours.push_back(group_colour(static_cast<std::size_t>(a)));
  return colours;
}

std::string some_of(std::size_t shown, std::size_t all, std::string_view what) {
  return shown < all ? fmt::format("{} of {} {}", shown, all, what) : fmt::format("{} {}", all, what);
}

TimePanels line_panels(const PathPicture& picture, bool momenta, std::size_t columns, bool stacked) {
  const Selection shown(picture, momenta, columns);
  const std::string what = momenta ? "Momenta p over time t" : "Positions q over time t";
  TimeRow row{{}, {}, momenta, kVertices, stacked};
  if (columns == 1) {
    row.headings.push_back(what + remark(shown, true));
    row.columns.push_back(curves_of(shown, 0, shown.path_count, 0));
  } else {
    for (std::size_t m = 0; m < columns; ++m) {
      row.headings.push_back(fmt::format("{}, path {}{}", what, m + 1, m == 0 ? remark(shown, false) : ""));
      row.columns.push_back(curves_of(shown, m, m + 1, 0));
    }
  }
  return TimePanels(std::move(row));
}

TimePanels component_panels(const PathPicture& picture, bool stacked) {
  const auto d = static_cast<std::size_t>(picture.start.dimension());
  const Selection shown(picture, true, 1);
  TimeRow row{{}, {}, true, kVertices, stacked};
  for (std::size_t i = 0; i < d; ++i) {
    row.headings.push_back(fmt::format("Momenta p, component {}, over time t", "xyz"[i]));
    if (i == 0 && shown.path_count < shown.paths.size())
      row.headings.back() += ", " + some_of(shown.path_count, shown.paths.size(), "paths");
    row.columns.push_back(curves_of(shown, 0, shown.path_count, static_cast<int>(i)));
  }
  return TimePanels(std::move(row));
}

std::vector<LegendEntry> legend_of_landmarks(const PathPicture& picture) {
  const auto n = static_cast<std::size_t>(picture.start.count());
  if (n > kMostNamed) {
    const Interval q = range_of({&picture.start.points}, 0);
    return {bar_entry(fmt::format("landmarks in their order at the start, q = {:.4g}", q.low),
                      fmt::format("{:.4g}", q.high))};
  }
  const std::vector<Colour> colours = landmark_colours(picture);
  const std::vector<std::string> names = names_of(picture.start);
  std::vector<LegendEntry> entries;
  for (std::size_t a = 0; a < n; ++a) entries.push_back(line_entry(names[a], colours[a]));
  return entries;
}

Ends choose_ends(const PathPicture& picture, std::size_t vertices) {
  const std::size_t paths =
      std::clamp<std::size_t>(vertices / static_cast<std::size_t>(picture.start.count()), 1, picture.positions.size());
  const auto [low, high] = bounding_box(picture.start.points);
  const Eigen::VectorXd centre = low + (high - low) / 2;
  std::vector<double> distances;
  for (std::size_t m = 1; m < paths; ++m) distances.push_back(distance(picture.positions[m].back(), centre));
  double limit = 0;
  if (!distances.empty()) {
    std::vector<double> sorted = distances;
    std::sort(sorted.begin(), sorted.end());
    limit = kFarthest * sorted[9 * (sorted.size() - 1) / 10];
    for (const Points& points : picture.positions.front()) limit = std::max(limit, distance(points, centre));
  }

  Ends ends;
  for (std::size_t m = 1; m < paths; ++m)
    if (distances[m - 1] <= limit)
      ends.others.push_back(m);
    else
      ++ends.outside;
  return ends;
}

}  // namespace pulson::draw
