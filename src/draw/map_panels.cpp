#include "map_panels.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace pulson::draw {
namespace {

constexpr double kPanelGap = 110;  // with the numbers of the right panel
const Stroke kCurve{{"#868E99", 0.75}, 1.8};

/// Rows x and y.
Points pairs(const Points& x, const Points& y) {
  Points points(2, x.cols());
  points << x.row(0), y.row(0);
  return points;
}

/// Where points between the landmarks start and end, and the landmarks themselves, from the lowest start on.
Points material(const RegistrationPicture& picture) {
  const auto points = static_cast<Eigen::Index>(picture.grid_paths.size());
  if (points == 0) return {2, 0};
  Points ends(2, points + picture.result.cols());
  ends.rightCols(picture.result.cols()) = pairs(picture.source.points, picture.result);
  for (std::size_t m = 0; m < picture.grid_paths.size(); ++m)
    ends.col(static_cast<Eigen::Index>(m)) << picture.grid_paths[m](1, 0),
        picture.grid_paths[m](1, picture.grid_paths[m].cols() - 1);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(ends.cols()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](auto i, auto j) { return ends(0, i) < ends(0, j); });
  return ends(Eigen::all, order);
}

/// Each end less its start.
Points displacements(Points points) {
  points.row(1) -= points.row(0);
  return points;
}

/// What one panel shows: rows start and value.
struct Panel {
  Points target;
  Points result;
  Points curve;
  Points reference;  // the line of what stays
};

void draw_panel(Canvas& canvas, View view, const std::string& heading, const Panel& panel, const Figure& figure) {
  const std::vector<const Points*> sets = {&panel.target, &panel.result};
  const std::vector<Interval> ranges = with_margins({range_of(sets, 0)}, 0);
  view.x = ranges[0];
  view.y = with_margins({range_of(sets, 1)}, 0)[0];
  draw_frame(canvas, view, heading, true);
  const auto reference = [&](double x) { return panel.reference(0, 0) * x + panel.reference(1, 0); };
  canvas.look_through(view.box);
  canvas.lines({view.pixels(line(view.x.low, reference(view.x.low), view.x.high, reference(view.x.high)))},
               {colour::kReference, 1.2});
  canvas.lines({view.pixels(panel.curve)}, kCurve);
  canvas.look_through({});
  const Marks marks(figure);
  canvas.rings(view.pixels(panel.target), std::max(marks.ring, 3.4), {colour::kTarget, std::max(marks.stroke, 1.2)});
  canvas.dots(view.pixels(panel.result), std::max(marks.dot, 2.0), colour::kResult);
}

}  // namespace

void draw_map_panels(Canvas& canvas, const Box& box, const RegistrationPicture& picture, const Figure& figure) {
  const Points& source = picture.source.points;
  const bool corresponds = picture.corresponds;
  const Points target = corresponds ? complete(pairs(source, picture.target.points)) : Points(2, 0);
  const Points result = pairs(source, picture.result), curve = material(picture);
  Box left = box, right = box;
  left.width = right.width = (box.width - kPanelGap) / 2;
  right.left = box.left + left.width + kPanelGap;
  const Points same = (Points(2, 1) << 1, 0).finished(), none = (Points(2, 1) << 0, 0).finished();
  draw_panel(canvas, {.box = left, .x = {0, 1}, .y = {0, 1}}, "Target and result over the source",
             {target, result, curve, same}, figure);
  draw_panel(canvas, {.box = right, .x = {0, 1}, .y = {0, 1}}, "Displacements over the source",
             {displacements(target), displacements(result), displacements(curve), none}, figure);
}

}  // namespace pulson::draw
