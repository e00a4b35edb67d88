#include <algorithm>
#include <cmath>
#include <numeric>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "shape_panels.hpp"

namespace pulson::draw {
namespace {

constexpr double kPanelWidth = 1000, kTallestPlot = 760, kLeastHeight = 420;
constexpr double kLeft = (kLeastWidth - kPanelWidth) / 2 + 30, kNarrowLeft = 96;  // with room for numbers
constexpr double kDot = 5.5, kDotMargin = 1.5;
constexpr double kLabelText = 15, kAxisLabel = 18;

Interval range_of_scores(const ScorePlot& plot, int row) {
  std::vector<const Points*> sets;
  for (const ScorePlot::Group& group : plot.groups) sets.push_back(&group.scores);
  for (const Points& line : plot.lines) sets.push_back(&line);
  const Interval range = range_of(sets, row);
  return range.with_span(range.span() * (1 + 2 * 0.06));
}

// Labels beside their dots, those that cover neither dots nor other labels; the outermost dots first, which are asked
// about most.
void draw_labels(Canvas& canvas, const View& view, const ScorePlot& plot) {
  Points pixels(2, 0);
  std::vector<std::string> labels;
  for (const auto& group : plot.groups) {
    pixels = (Points(2, pixels.cols() + group.scores.cols()) << pixels, view.pixels(group.scores)).finished();
    labels.insert(labels.end(), group.labels.begin(), group.labels.end());
  }
  if (labels.size() != static_cast<std::size_t>(pixels.cols())) return;
  const Eigen::Vector2d middle = pixels.rowwise().mean();
  std::vector<std::size_t> order(labels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto distance = [&](std::size_t i) { return (pixels.col(static_cast<Eigen::Index>(i)) - middle).norm(); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return distance(a) > distance(b); });
  std::vector<Box> taken;
  for (const std::size_t i : order) {
    const double width = text_width(labels[i], kLabelText);
    const auto [box, covered] =
        freest_place(pixels.col(static_cast<Eigen::Index>(i)), width, kLabelText, kDot + kDotMargin, pixels, taken);
    if (covered > 0 || box.left <= view.box.left || box.right() >= view.box.right()) continue;
    taken.push_back(box);
    canvas.text(box.left, box.bottom + box.height / 2, labels[i], kLabelText, colour::kText);
  }
}

Canvas compose(const ScorePlot& plot, bool narrow) {
  Interval x = range_of_scores(plot, 0), y = range_of_scores(plot, 1);
  const double width = narrow ? kNarrowWidth : kLeastWidth, left = narrow ? kNarrowLeft : kLeft;
  const double panel_width = narrow ? width - left - kEdge : kPanelWidth;
  const double tallest = std::min(kTallestPlot, 1.2 * panel_width);
  double height =
      plot.same_scale ? std::clamp(panel_width * y.span() / x.span(), kLeastHeight, tallest) : std::min(620.0, tallest);
  if (plot.same_scale) {
    const double scale = std::min(panel_width / x.span(), height / y.span());
    x = x.with_span(panel_width / scale);
    y = y.with_span(height / scale);
  }
  const bool grouped = plot.groups.size() > 1 || !plot.groups.front().name.empty();
  const double below = (grouped ? kLegendRoom : kEdge) + kTicRoom + 30;
  Canvas canvas =
      titled_canvas(narrow ? Titles() : Titles{plot.title, plot.subtitle}, left, width, kHeading + height + below);
  const View view{{left, below, panel_width, height}, x, y};
  draw_frame(canvas, view, plot.y_label, true);
  canvas.text(left + panel_width, view.box.bottom - kTicRoom - 8, plot.x_label, kAxisLabel, colour::kText,
              Align::kRight);
  std::vector<LegendEntry> legend;
  for (std::size_t g = 0; g < plot.groups.size() && grouped; ++g)
    if (plot.groups[g].scores.cols() > 2)
      canvas.areas({view.pixels(convex_hull(plot.groups[g].scores))}, faded(group_colour(g), 0.86));
  for (const Points& line : plot.lines) canvas.lines({view.pixels(line)}, {colour::kResult, 2});
  for (std::size_t g = 0; g < plot.groups.size(); ++g) {
    draw_marks(canvas, view.pixels(plot.groups[g].scores), kDot, {group_colour(g), g}, kDotMargin);
    if (!plot.groups[g].name.empty()) legend.push_back(dot_entry(plot.groups[g].name, {group_colour(g), g}));
  }
  draw_labels(canvas, view, plot);
  if (!legend.empty()) draw_legend(canvas, legend);
  return canvas;
}

}  // namespace

Points convex_hull(const Points& points) {
  std::vector<int> order(static_cast<std::size_t>(points.cols())), hull;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return std::pair(points(0, a), points(1, a)) < std::pair(points(0, b), points(1, b));
  });
  if (order.size() < 3) return points(Eigen::all, order);
  const auto turns_left = [&](int a, int b, int c) {
    const Eigen::Vector2d first = points.col(b) - points.col(a), second = points.col(c) - points.col(a);
    return first.x() * second.y() - first.y() * second.x() > 0;
  };
  for (int chain = 0; chain < 2; ++chain) {  // the lower one, then the upper
    const std::size_t least = hull.size() + 2;
    for (const int next : order) {
      while (hull.size() >= least && !turns_left(hull[hull.size() - 2], hull.back(), next)) hull.pop_back();
      hull.push_back(next);
    }
    hull.pop_back();
    std::reverse(order.begin(), order.end());
  }
  return points(Eigen::all, hull);
}

void write_score_plot(const ScorePlot& plot, const PictureFiles& files) {
  const Checks checks("scores plot");
  if (plot.groups.empty()) checks.refuse("there are no groups");
  for (const ScorePlot::Group& group : plot.groups) checks.points(group.scores, 2, "the scores");
  write_layouts(files, [&](bool narrow) { return compose(plot, narrow); });
}

}  // namespace pulson::draw
