#include "map_panels.hpp"

#include <algorithm>
#include <cmath>
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
  std::vector<std::pair<double, double>> ends;
  for (const Points& path : picture.grid_paths) ends.emplace_back(path(1, 0), path(1, path.cols() - 1));
  for (Eigen::Index a = 0; a < picture.result.cols() && !ends.empty(); ++a)
    ends.emplace_back(picture.source.points(0, a), picture.result(0, a));
  std::sort(ends.begin(), ends.end());
  Points curve(2, static_cast<Eigen::Index>(ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i)
    curve.col(static_cast<Eigen::Index>(i)) << ends[i].first, ends[i].second;
  return curve;
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
  double slope;  // of the line of what stays
};

void draw_panel(Canvas& canvas, const Box& box, const std::string& heading, const Panel& panel, const Figure& figure) {
  const std::vector<const Points*> sets = {&panel.target, &panel.result};
  const View view{box, with_margins({range_of(sets, 0)}, 0)[0], with_margins({range_of(sets, 1)}, 0)[0]};
  draw_frame(canvas, view, heading, true);
  canvas.look_through(view.box);
  canvas.lines({view.pixels(line(view.x.low, panel.slope * view.x.low, view.x.high, panel.slope * view.x.high))},
               {colour::kReference, 1.2});
  canvas.lines({view.pixels(panel.curve)}, kCurve);
  canvas.look_through({});
  const Marks marks(figure);
  canvas.rings(view.pixels(panel.target), std::max(marks.ring, 3.4), {colour::kTarget, std::max(marks.stroke, 1.2)});
  canvas.dots(view.pixels(panel.result), std::max(marks.dot, 2.0), colour::kResult);
}

}  // namespace

void draw_map_panels(Canvas& canvas, const Box& box, bool stacked, const RegistrationPicture& picture,
                     const Figure& figure) {
  const Points& source = picture.source.points;
  const Points target = picture.corresponds ? pairs(source, picture.target.points) : Points(2, 0);
  const Points result = pairs(source, picture.result), curve = material(picture);
  Box first = box, second = box;
  if (stacked) {
    first.height = second.height = (box.height - kHeading - kTicRoom) / 2;
    first.bottom = box.bottom + second.height + kHeading + kTicRoom;
  } else {
    first.width = second.width = (box.width - kPanelGap) / 2;
    second.left = box.left + first.width + kPanelGap;
  }
  draw_panel(canvas, first, "Target and result over the source", {target, result, curve, 1}, figure);
  draw_panel(canvas, second, "Displacements over the source",
             {displacements(target), displacements(result), displacements(curve), 0}, figure);
}

}  // namespace pulson::draw
