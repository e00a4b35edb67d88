#include "space_panels.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace pulson::draw {
namespace {

constexpr double kTallestRows = 980;  // of both rows of panels
constexpr double kYaw = -0.6;         // radians, as on the page
constexpr double kPitch = 0.45;
constexpr double kLongestDisplacement = 0.2;  // of the shape's diagonal
constexpr double kNumbers = 64;               // at the left of a panel, at least

Screen side_screen() {
  const double sine = std::sin(kPitch);
  Screen screen;
  screen << std::cos(kYaw), std::sin(kYaw), 0,  //
      -std::sin(kYaw) * sine, std::cos(kYaw) * sine, std::cos(kPitch);
  return screen;
}

/// The places seen from the side: to the right and upwards, 2×N.
Points from_the_side(const Points& points) { return side_screen() * points; }

constexpr double kFiner = 2;             // pixels of the surface in one of the canvas
constexpr double kSurfaceOpacity = 0.8;  // so that marks behind it are seen to be there

Window window_of(const View& view) {
  return {{view.x.low, view.y.low},
          {view.x.high, view.y.high},
          std::max(1, static_cast<int>(std::lround(kFiner * view.box.width)))};
}

void draw_surface(Canvas& canvas, const View& view, const SurfaceParts& surface, const Screen& screen) {
  if (surface.triangles.empty()) return;
  Raster raster = shaded(surface, screen, window_of(view));
  for (std::size_t i = 3; i < raster.rgba.size(); i += 4)
    raster.rgba[i] = static_cast<std::uint8_t>(kSurfaceOpacity * raster.rgba[i]);
  canvas.raster(raster, view.box);
}

std::vector<int> hidden_points(const View& view, const SurfaceParts& surface, const Points& points,
                               const Screen& screen) {
  if (surface.triangles.empty()) return {};
  return points_behind(surface, screen, window_of(view), points);
}

Screen screen_of(const View& view) {
  Screen screen = Screen::Zero();
  screen(0, view.row_x) = screen(1, view.row_y) = 1;
  return screen;
}

/// The edges of the box around places in space.
std::vector<Points> edges_of_box(const Points& points) {
  const auto [low, high] = bounding_box(points);
  std::vector<Points> edges;
  for (int corner = 0; corner < 8; ++corner)
    for (const int bit : {1, 2, 4}) {
      if ((corner & bit) != 0) continue;
      Points edge(3, 2);
      for (int axis = 0; axis < 3; ++axis) {
        edge(axis, 0) = ((corner >> axis) & 1) != 0 ? high[axis] : low[axis];
        edge(axis, 1) = (((corner | bit) >> axis) & 1) != 0 ? high[axis] : low[axis];
      }
      edges.push_back(from_the_side(edge));
    }
  return edges;
}

/// The panel's view, in one scale, of all of these.
View fitted(const Box& box, const std::vector<const Points*>& sets) {
  View view{.box = box, .x = range_of(sets, 0), .y = range_of(sets, 1)};
  const double room = 1 - 2 * kMargin;
  const double unit = std::max({view.x.span() / (room * box.width), view.y.span() / (room * box.height), 1e-300});
  view.x = view.x.with_span(unit * box.width);
  view.y = view.y.with_span(unit * box.height);
  return view;
}

}  // namespace

Plan arrange_space(const Titles& titles, const std::vector<Interval>& ranges, const Arrangement& arrangement) {
  std::array<int, 3> axes = {0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int i, int j) { return ranges[i].span() > ranges[j].span(); });
  const auto [a, b, c] = axes;
  const auto view = [&](int i, int j) { return View{{}, ranges[i], ranges[j], i, j}; };
  std::vector<View> views = {view(a, c), view(b, c), view(a, b)};
  if (arrangement.stacked) {
    views.push_back(views.front());  // room for the view from the side
    Plan plan = arrange(titles, views, arrangement);
    plan.side = plan.views.back().box;
    plan.views.pop_back();
    return plan;
  }
  const double across = ranges[a].span() + ranges[b].span(), down = ranges[c].span() + ranges[b].span();
  const auto scale_beside = [&](double numbers) {
    return std::min((kWidth - 2 * kEdge - kGap - 2 * numbers) / across, kTallestRows / down);
  };
  double numbers = std::max(kNumbers, arrangement.number_room);
  for (const View& one : views)
    numbers = std::max(numbers, left_number_width(one.y, scale_beside(numbers) * one.y.span()));
  const double scale = scale_beside(numbers);
  const double width = std::max(arrangement.least_width, 2 * kEdge + kGap + 2 * numbers + scale * across);
  const double spare = (width - 2 * kEdge - kGap - 2 * numbers - scale * across) / 2 / scale;  // for each column
  const double height = scale * down + 2 * (kHeading + kTicRoom) + arrangement.room_below + kLegendRoom;
  const double left = kEdge + numbers, right = left + scale * (ranges[a].span() + spare) + kGap + numbers;
  const double top = height - kHeading;
  const double below = top - scale * ranges[c].span() - kTicRoom - kHeading;
  const auto placed = [&](View& one, double from, double upper) {
    one.x = one.x.with_span(one.x.span() + spare);
    one.box = {from, upper - scale * one.y.span(), scale * one.x.span(), scale * one.y.span()};
  };
  placed(views[0], left, top);
  placed(views[1], right, top);
  placed(views[2], left, below);
  const Box side{right, views[2].box.bottom, views[1].box.width, views[2].box.height};
  return {titled_canvas(titles, left, width, height), std::move(views), side};
}

void draw_surface(Canvas& canvas, const View& view, const SurfaceParts& surface) {
  draw_surface(canvas, view, surface, screen_of(view));
}

std::vector<int> hidden_points(const View& view, const SurfaceParts& surface, const Points& points) {
  return hidden_points(view, surface, points, screen_of(view));
}

SplitFigure split(const Figure& figure, const std::vector<int>& hidden, Eigen::Index count) {
  std::vector<int> others;
  for (int a = 0; a < count; ++a)
    if (!std::binary_search(hidden.begin(), hidden.end(), a)) others.push_back(a);
  SplitFigure parts{figure, without(figure, others)};
  // Outlines stay whole in front: a line that ends at a mark behind is easier to read than one that leaves it out.
  for (std::vector<int>& members : parts.seen.groups)
    std::erase_if(members, [&](int a) { return std::binary_search(hidden.begin(), hidden.end(), a); });
  std::erase_if(parts.seen.marked, [&](int a) { return std::binary_search(hidden.begin(), hidden.end(), a); });
  parts.hidden.outlines.clear();
  parts.hidden.links.clear();
  return parts;
}

void draw_displacements(Canvas& canvas, const Box& box, const Points& from, const Points& to, const Figure& figure,
                        const SurfaceParts& surface) {
  const Points moved = to - from;
  const auto [low, high] = bounding_box(from);
  const double longest = std::max(moved.colwise().norm().maxCoeff(), 1e-300);
  const double factor = std::max(1.0, round_factor(kLongestDisplacement * (high - low).norm() / longest));
  const Points tips = from_the_side(from + factor * moved), feet = from_the_side(from);
  const Points vertices = surface.triangles.empty() ? Points(2, 0) : from_the_side(surface.vertices);
  const std::vector<Points> edges = surface.triangles.empty() ? edges_of_box(from) : std::vector<Points>{};
  std::vector<const Points*> sets = {&tips, &feet, &vertices};
  for (const Points& edge : edges) sets.push_back(&edge);
  const View view = fitted(box, sets);
  draw_frame(canvas, view,
             factor > 1 ? fmt::format("Displacements × {:g}, from the side", factor) : "Displacements, from the side",
             {}, {});
  const Points seen = view.pixels(feet);
  const SplitFigure parts = split(figure, hidden_points(view, surface, from, side_screen()), from.cols());
  draw_start(canvas, seen, parts.hidden);
  draw_surface(canvas, view, surface, side_screen());
  canvas.lines(view.pixels(edges), {colour::kGrid, 1.2});
  for (std::size_t group = 0; group < figure.groups.size(); ++group)
    canvas.lines(trace(figure, false, seen, group), {faded(colour::kSource, 0.6), 1.1});
  canvas.arrows(seen(Eigen::all, figure.with_path), view.pixels(tips)(Eigen::all, figure.with_path),
                {colour::kMomentum, Marks(figure).stroke});
  draw_start(canvas, seen, parts.seen);
}

}  // namespace pulson::draw
