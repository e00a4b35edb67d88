#include "shape_panels.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"

namespace pulson::draw {
namespace {

const Stroke kPanelGridStroke{colour::kGrid, 1.1};
constexpr double kTallestPanel = 520;  // of a panel
constexpr double kTallestAlone = 860;  // of the panels of a single row in the plane
constexpr double kMostDot = 5;         // beside displacements, which larger ones would hide
constexpr double kRowGap = 16;
constexpr double kFlattest = 0.15;

// The ranges of all coordinates that panels show.
std::vector<Interval> ranges_of(const ShapePanels& picture) {
  std::vector<const Points*> sets{&picture.reference.points};
  for (const auto& panels : picture.rows)
    for (const ShapePanel& panel : panels) {
      sets.push_back(&panel.shape);
      for (const Points& line : panel.grid) sets.push_back(&line);
      for (const Points& dots : panel.cloud) sets.push_back(&dots);
    }
  return draw::ranges_of(sets, picture.reference.dimension(), kFlattest);
}

// The planes that each panel shows: in space those of the longest axis with each of the others.
std::vector<View> views_of(const ShapePanels& picture) {
  const std::vector<Interval> ranges = ranges_of(picture);
  if (ranges.size() == 2) return {{{}, ranges[0], ranges[1], 0, 1, picture.reference.frame.y_down}};
  std::vector<int> axes{0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return ranges[a].span() > ranges[b].span(); });
  return {{{}, ranges[axes[0]], ranges[axes[1]], axes[0], axes[1]},
          {{}, ranges[axes[0]], ranges[axes[2]], axes[0], axes[2]}};
}

void draw_panel(Canvas& canvas, const View& view, const ShapePanel& panel, const ShapePanels& picture,
                const Figure& figure) {
  const Marks marks(figure);
  if (panel.image) {
    canvas.look_through(view.box);
    draw_image(canvas, view, panel.image);
    canvas.look_through({});
  }
  canvas.lines(view.pixels(panel.grid), kPanelGridStroke);
  const std::vector<std::vector<int>> groups = landmarks_by_group(picture.reference);
  for (const Points& dots : panel.cloud)
    for (std::size_t g = 0; g < groups.size(); ++g)
      canvas.dots(view.pixels(Points(dots(Eigen::all, groups[g]))), std::min(2.2, marks.dot),
                  faded(figure.names.empty() ? colour::kSource : group_colour(g), 0.45));
  const Points reference = view.pixels(picture.reference.points);
  if (panel.shape.size() == 0) {
    draw_shape(canvas, reference, figure, colour::kResult);
    draw_names(canvas, reference, figure, picture.reference);
  } else {
    const Points shape = view.pixels(panel.shape);
    for (const bool dense : {true, false})
      canvas.lines(trace(figure, dense, reference), {colour::kReference, marks.outline});
    canvas.segments(reference(Eigen::all, figure.marked), shape(Eigen::all, figure.marked),
                    {colour::kMomentum, marks.path});
    const double dot = std::min(marks.dot, kMostDot);
    canvas.dots(reference(Eigen::all, figure.marked), 0.8 * dot, colour::kReference);
    draw_shape(canvas, shape, figure, colour::kResult, dot);
  }
  draw_frame(canvas, view, "", {}, {});
}

std::vector<LegendEntry> legend_of(const ShapePanels& picture, const Figure& figure) {
  const auto entry = [&](const std::string& text, const Colour& colour) {
    return figure.marked.empty() ? line_entry(text, colour) : dot_entry(text, {colour});
  };
  const bool is_alone = picture.shape_name.empty();
  std::vector<LegendEntry> legend;
  if (!is_alone || figure.names.empty())
    legend.push_back(entry(picture.reference_name, is_alone ? colour::kResult : colour::kReference));
  if (!figure.names.empty())
    for (LegendEntry& group : legend_of_shape(figure, colour::kResult, "")) legend.push_back(std::move(group));
  else if (!is_alone)
    legend.push_back(entry(picture.shape_name, colour::kResult));
  if (!is_alone && !figure.marked.empty()) legend.push_back(line_entry("displacement", colour::kMomentum));
  if (!picture.cloud_name.empty())
    legend.push_back(dot_entry(picture.cloud_name,
                               {figure.names.empty() ? faded(colour::kSource, 0.3) : faded(colour::kReference, 0.3)}));
  return legend;
}

using PanelRows = std::vector<std::vector<ShapePanel>>;

PanelRows one_above_the_other(const PanelRows& rows) {
  PanelRows column;
  for (const auto& row : rows)
    for (const ShapePanel& panel : row) column.push_back({panel});
  return column;
}

Canvas compose(const ShapePanels& picture, bool narrow) {
  const std::vector<View> planes = views_of(picture);
  const PanelRows rows = narrow ? one_above_the_other(picture.rows) : picture.rows;
  std::size_t columns = 1;
  for (const auto& row : rows) columns = std::max(columns, row.size());
  const auto count = static_cast<double>(columns);
  const double room = ((narrow ? kNarrowWidth : kWidth) - 2 * kEdge - (count - 1) * kGap) / count;
  const double tallest = rows.size() == 1 && planes.size() == 1 ? kTallestAlone : kTallestPanel;
  double scale = 1e300;
  for (const View& plane : planes) scale = std::min({scale, room / plane.x.span(), tallest / plane.y.span()});
  double rows_height = 0;
  for (const View& plane : planes) rows_height += scale * plane.y.span() + kHeading + kRowGap;
  const double used = count * scale * planes.front().x.span() + (count - 1) * kGap + 2 * kEdge;
  const double width = std::max(narrow ? kNarrowWidth : kLeastWidth, used), left = (width - used) / 2 + kEdge;
  double top = static_cast<double>(rows.size()) * rows_height + kLegendRoom;
  Canvas canvas = titled_canvas(narrow ? Titles() : Titles{picture.title, picture.subtitle}, left, width, top);
  const Figure figure = plan_figure(picture.reference, scale);
  for (const auto& row : rows)
    for (const View& plane : planes) {
      const double panel_width = scale * plane.x.span(), height = scale * plane.y.span();
      top -= kHeading + height;
      for (std::size_t c = 0; c < row.size(); ++c) {
        View view = plane;
        view.box = {left + static_cast<double>(c) * (panel_width + kGap), top, panel_width, height};
        draw_panel(canvas, view, row[c], picture, figure);
        draw_heading(canvas, view.box, planes.size() > 1 ? row[c].heading + "   " + axis_names(plane) : row[c].heading);
      }
      top -= kRowGap;
    }
  draw_legend(canvas, legend_of(picture, figure));
  return canvas;
}

}  // namespace
void write_shape_panels(const ShapePanels& picture, const PictureFiles& files) {
  const Checks checks("picture of shapes");
  checks.shape(picture.reference, "the reference");
  for (const auto& row : picture.rows)
    for (const ShapePanel& panel : row)
      if (panel.shape.size() > 0)
        checks.landmarks(panel.shape, picture.reference, "the reference", "the shape '" + panel.heading + "'");
  write_layouts(files, [&](bool narrow) { return compose(picture, narrow); });
}

}  // namespace pulson::draw
