#include "compositions.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "layers.hpp"
#include "view.hpp"

namespace pulson::picture {
namespace {

constexpr double kWidth = 1600;
constexpr double kLeastWidth = 1200;
constexpr double kEdge = 26;        // of the canvas
constexpr double kGap = 40;         // between panels
constexpr double kHeading = 42;     // above a panel
constexpr double kTicRoom = 38;     // below a panel
constexpr double kLegendRoom = 64;  // below all panels
constexpr double kMargin = 0.04;    // around the data, of their span
const Stroke kGridStroke{colour::kGrid, 1.25};
constexpr double kNumberRoom = 90;  // first guess of the numbers at the left

std::vector<const Points*> addresses(const std::vector<const std::vector<Points>*>& lists) {
  std::vector<const Points*> result;
  for (const auto* list : lists)
    for (const Points& points : *list) result.push_back(&points);
  return result;
}

/// The ranges of all coordinates with a margin; none is less than `flattest` of the widest.
std::vector<Interval> data_ranges(const RegistrationPicture& picture, double flattest) {
  std::vector<const Points*> sets = addresses({&picture.trajectory, &picture.grid_before, &picture.grid_after});
  sets.insert(sets.end(), {&picture.source.points, &picture.target, &picture.result});
  std::vector<Interval> ranges;
  double widest = 0, largest = 0;
  const std::vector<const Points*> paths = addresses({&picture.grid_paths});
  for (int row = 0; row < picture.source.dimension(); ++row) {
    ranges.push_back(range_of(sets, row));
    if (!paths.empty()) ranges.back() = ranges.back().joined(range_of(paths, 1));
    widest = std::max(widest, ranges.back().span());
    largest = std::max({largest, std::abs(ranges.back().low), std::abs(ranges.back().high)});
  }
  if (widest <= 1e-9 * largest) widest = largest > 0 ? 0.2 * largest : 1;  // all at one place
  for (Interval& range : ranges)
    range = range.with_span(std::max(range.span(), flattest * widest) + 2 * kMargin * widest);
  return ranges;
}

/// Panels of one scale: their canvas, and where each lies.
struct Plan {
  Canvas canvas;
  std::vector<View> views;
};

/// Views side by side (tops in one line) or one above the other, at the largest common scale that keeps to the width of
/// the canvas and to `tallest`. `all_numbered`: every panel has numbers at
/// its left, not the first alone.
Plan arrange(const RegistrationPicture& picture, std::vector<View> views, bool stacked, double tallest,
             bool all_numbered) {
  double sum_x = 0, most_y = 0, sum_y = 0;
  for (const View& view : views) {
    sum_x = stacked ? std::max(sum_x, view.x.span()) : sum_x + view.x.span();
    most_y = std::max(most_y, view.y.span());
    sum_y += view.y.span();
  }
  const double columns = stacked ? 1 : static_cast<double>(views.size());
  double numbers = kNumberRoom;
  const auto frame_width = [&] { return 2 * kEdge + numbers + (columns - 1) * (all_numbered ? kGap + numbers : kGap); };
  double scale = std::min((kWidth - frame_width()) / sum_x, tallest / most_y);
  numbers = 0;
  for (const View& view : views) numbers = std::max(numbers, left_number_width(view.y, scale * view.y.span()));
  scale = std::min((kWidth - frame_width()) / sum_x, tallest / most_y);

  const double width = std::max(kLeastWidth, frame_width() + scale * sum_x);
  const double spare = (width - frame_width() - scale * sum_x) / columns / scale;
  const double rows_height = stacked ? scale * sum_y + static_cast<double>(views.size()) * (kHeading + kTicRoom)
                                     : scale * most_y + kHeading + kTicRoom;
  const double height = title_height(picture) + rows_height + kLegendRoom;
  double left = kEdge + numbers, top = height - title_height(picture) - kHeading;
  for (View& view : views) {
    view.x = view.x.with_span(view.x.span() + spare);
    view.box = {left, top - scale * view.y.span(), scale * view.x.span(), scale * view.y.span()};
    if (stacked)
      top -= view.box.height + kHeading + kTicRoom;
    else
      left += view.box.width + kGap + (all_numbered ? numbers : 0);
  }
  Canvas canvas(std::round(width), std::round(height));
  draw_titles(canvas, picture, kEdge + numbers);
  return {std::move(canvas), std::move(views)};
}

/// Pixels per length unit, the same in all views.
double scale_of(const View& view) { return view.box.width / view.x.span(); }

/// Paths, target and result on top of one another, as one panel shows them.
void draw_flow(Canvas& canvas, const View& view, const RegistrationPicture& picture, const Figure& figure) {
  const Marks marks(figure);
  const Points target = view.pixels(picture.target), result = view.pixels(picture.result);
  const Points source = view.pixels(picture.source.points);
  draw_paths_by_time(canvas, view.pixels(picture.trajectory), picture.times, figure);
  canvas.lines(trace(figure, true, source), {colour::kSource, 1});
  canvas.dots(source(Eigen::all, figure.marked), 0.6 * marks.dot, colour::kSource);
  draw_target(canvas, target, figure);
  canvas.segments(result(Eigen::all, figure.marked), target(Eigen::all, figure.marked),
                  {colour::kTarget, marks.stroke});
  draw_shape(canvas, result, figure, colour::kResult);
}

}  // namespace

Canvas compose_plane(const RegistrationPicture& picture) {
  const std::vector<Interval> ranges = data_ranges(picture, 0.15);
  const View view{{}, ranges[0], ranges[1]};
  const bool stacked = view.x.span() > 2.2 * view.y.span();
  Plan plan = arrange(picture, {view, view}, stacked, stacked ? 560 : 900, stacked);
  Canvas& canvas = plan.canvas;
  const View& before = plan.views[0];
  const View& after = plan.views[1];
  const Figure figure = plan_figure(picture.source, scale_of(before));

  draw_frame(canvas, before, "Source", true);
  canvas.lines(before.pixels(picture.grid_before), kGridStroke);
  draw_target(canvas, before.pixels(picture.target), figure);
  draw_shape(canvas, before.pixels(picture.source.points), figure, colour::kSource);
  draw_numbers(canvas, before.pixels(picture.source.points), figure);

  draw_frame(canvas, after, "Result", stacked);
  canvas.lines(after.pixels(picture.grid_after), kGridStroke);
  draw_flow(canvas, after, picture, figure);

  std::vector<LegendEntry> legend = legend_of_shapes(figure);
  if (!picture.grid_after.empty()) legend.push_back(legend_of_grid("material grid"));
  legend.push_back(legend_of_time(picture.times));
  draw_legend(canvas, legend);
  return std::move(canvas);
}

Canvas compose_space(const RegistrationPicture& picture) {
  const std::vector<Interval> ranges = data_ranges(picture, 0.4);
  constexpr std::array<std::array<int, 2>, 3> kPlanes{{{0, 1}, {0, 2}, {1, 2}}};
  std::vector<View> views;
  views.reserve(kPlanes.size());
  for (const auto& [row_x, row_y] : kPlanes) views.push_back({{}, ranges[row_x], ranges[row_y], row_x, row_y});
  Plan plan = arrange(picture, std::move(views), false, 700, true);
  const Figure figure = plan_figure(picture.source, scale_of(plan.views[0]));
  for (const View& view : plan.views) {
    constexpr std::array<char, 3> kNames{'x', 'y', 'z'};
    draw_frame(plan.canvas, view, fmt::format("{} →   {} ↑", kNames[view.row_x], kNames[view.row_y]), true);
    plan.canvas.lines(trace(figure, false, view.pixels(picture.source.points)),
                      {faded(colour::kSource, 0.4), Marks(figure).outline});
    draw_flow(plan.canvas, view, picture, figure);
  }
  std::vector<LegendEntry> legend = legend_of_shapes(figure);
  legend.push_back(legend_of_time(picture.times));
  draw_legend(plan.canvas, legend);
  return std::move(plan.canvas);
}

Canvas compose_line(const RegistrationPicture& picture) {
  constexpr double kPanelHeight = 760;
  const Interval x = data_ranges(picture, 1)[0];
  const double start = picture.times.front(), end = picture.times.back();
  const Interval t = Interval{start, end}.with_span((1 + 2 * kMargin) * (end - start));
  const double left = kEdge + left_number_width(x, kPanelHeight);
  const double height = title_height(picture) + kHeading + kPanelHeight + kTicRoom + kLegendRoom;
  Canvas canvas(kWidth, std::round(height));
  const View view{{left, kTicRoom + kLegendRoom, kWidth - kEdge - left, kPanelHeight}, t, x};
  const Figure figure = plan_figure(picture.source, kPanelHeight / x.span());
  draw_titles(canvas, picture, left);
  draw_frame(canvas, view, "Position x over time t", true);
  canvas.lines(view.pixels(picture.grid_paths), kGridStroke);

  const std::vector<Colour> colours = colours_by_position(picture.source.points);
  for (int a = 0; a < picture.source.count(); ++a) {
    Points path(2, picture.times.size());
    for (std::size_t k = 0; k < picture.times.size(); ++k) path.col(k) << picture.times[k], picture.trajectory[k](0, a);
    canvas.lines({view.pixels(path)}, {colours[a], Marks(figure).path});
  }
  const auto at = [&](double time, const Points& positions) {
    Points points(2, positions.cols());
    points << Eigen::RowVectorXd::Constant(positions.cols(), time), positions;
    return view.pixels(points);
  };
  draw_shape(canvas, at(start, picture.source.points), figure, colour::kSource);
  draw_target(canvas, at(end, picture.target), figure);
  draw_shape(canvas, at(end, picture.result), figure, colour::kResult);
  std::vector<LegendEntry> legend = legend_of_shapes(figure);
  if (!picture.grid_paths.empty()) legend.push_back(legend_of_grid("paths of material points"));
  draw_legend(canvas, legend);
  return canvas;
}

}  // namespace pulson::picture
