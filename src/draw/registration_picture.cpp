#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "map_panels.hpp"
#include "path_panels.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/draw/pictures.hpp"
#include "space_panels.hpp"
#include "verdict_layers.hpp"

namespace pulson::draw {
namespace {

const Stroke kGridStroke{colour::kGrid, 1.25};
constexpr std::size_t kPathVertices = 250000;

Titles titles_of(const RegistrationPicture& picture) { return {picture.title, picture.subtitle}; }

/// What is drawn of source and result, and of the target.
struct Figures {
  Figure source;
  Figure target;
};

Figures plan_figures(const RegistrationPicture& picture, double scale) {
  Figure source = plan_figure(picture.source, scale);
  if (picture.corresponds) {
    Figure target = without(source, incomplete_points(picture.target.points));
    return {std::move(source), std::move(target)};
  }
  Figure target = plan_figure(picture.target, scale);
  target.names.clear();  // its groups have one colour
  return {std::move(source), std::move(target)};
}

/// The target at `pixels`. A few points of a target that does not correspond are no larger than the source's.
void draw_target(Canvas& canvas, const Points& pixels, const Figures& figures) {
  const Marks source(figures.source), target(figures.target);
  draw_target(canvas, pixels, figures.target, source.ring < target.ring ? source : target);
}

/// The ranges of all coordinates with a margin; none is less than `flattest` of the widest.
std::vector<Interval> data_ranges(const RegistrationPicture& picture, double flattest) {
  std::vector<const Points*> sets{&picture.source.points, &picture.target.points, &picture.result,
                                  &picture.surface_before, &picture.surface_after};
  for (const auto* list : {&picture.trajectory, &picture.grid_before, &picture.grid_after})
    for (const Points& points : *list) sets.push_back(&points);
  std::vector<Points> positions;  // of material points on a line, over time
  for (const Points& path : picture.grid_paths) positions.emplace_back(path.row(1));
  for (const Points& position : positions) sets.push_back(&position);
  return ranges_of(sets, picture.source.dimension(), flattest);
}

/// Paths, target and result on top of one another, as one panel shows them.
void draw_registration(Canvas& canvas, const View& view, const RegistrationPicture& picture, const Figures& figures) {
  const Figure& figure = figures.source;
  const Points target = view.pixels(picture.target.points), result = view.pixels(picture.result);
  const Points source = view.pixels(picture.source.points);
  draw_paths_by_time(canvas, view, {picture.trajectory, picture.times}, figure, Marks(figure).path, kPathVertices);
  draw_start(canvas, source, figure);
  draw_target(canvas, target, figures);
  if (picture.corresponds)
    canvas.segments(result(Eigen::all, figures.target.marked), target(Eigen::all, figures.target.marked),
                    {colour::kTarget, Marks(figure).stroke});
  draw_shape(canvas, result, figure, colour::kResult);
  draw_doubts(canvas, result, picture.doubted, Marks(figure).ring);
}

/// The entries for source, target and result, as the figure shows them.
std::vector<LegendEntry> legend_of_shapes(const Figures& figures, const RegistrationPicture& picture) {
  const bool lines = figures.target.marked.empty(), grouped = !figures.target.names.empty();
  std::vector<LegendEntry> entries = legend_of_shape(figures.source, colour::kSource, "source");
  if (!lines || !figures.target.outlines.empty())
    entries.push_back(lines && !grouped ? line_entry("target", colour::kTarget)
                                        : ring_entry("target", colour::kTarget));
  if (figures.source.names.empty())
    entries.push_back(legend_of_shape(figures.source, colour::kResult, "result").front());
  for (LegendEntry& entry : legend_of_verdicts(picture)) entries.push_back(std::move(entry));
  return entries;
}

Arrangement arrangement_of(const View& view, bool narrow) {
  if (narrow) return narrow_arrangement();
  const bool stacked = view.x.span() > 2.2 * view.y.span();
  return {.stacked = stacked, .tallest = stacked ? 560.0 : 900.0, .all_numbered = stacked};
}

Canvas compose_plane(const RegistrationPicture& picture, bool narrow) {
  const std::vector<Interval> ranges = data_ranges(picture, 0.15);
  const View view{
      .box = {}, .x = ranges[0], .y = ranges[1], .y_down = picture.source.frame.y_down || picture.target.frame.y_down};
  const Arrangement arrangement = arrangement_of(view, narrow);
  Plan plan = arrange(narrow ? Titles() : titles_of(picture), {view, view}, arrangement);
  Canvas& canvas = plan.canvas;
  const View& before = plan.views[0];
  const View& after = plan.views[1];
  const Figures figures = plan_figures(picture, scale_of(before));
  const Figure& figure = figures.source;

  draw_frame(canvas, before, picture.aligned ? "Source, aligned" : "Source", true);
  draw_image(canvas, before, picture.image_before);
  canvas.lines(before.pixels(picture.grid_before), kGridStroke);
  draw_target(canvas, before.pixels(picture.target.points), figures);
  draw_energy(canvas, before.pixels(picture.source.points), picture);
  draw_shape(canvas, before.pixels(picture.source.points), figure, colour::kSource);
  draw_names(canvas, before.pixels(picture.source.points), figure, picture.source,
             before.pixels(Points(picture.target.points(Eigen::all, figures.target.marked))));

  draw_frame(canvas, after, "Result", arrangement.stacked);
  draw_image(canvas, after, picture.image_after);
  canvas.lines(after.pixels(picture.grid_after), kGridStroke);
  draw_action(canvas, after.pixels(picture.result), picture);
  draw_registration(canvas, after, picture, figures);

  std::vector<LegendEntry> legend = legend_of_shapes(figures, picture);
  if (!picture.grid_after.empty()) legend.push_back(line_entry("material grid", colour::kGrid));
  legend.push_back(legend_of_time(picture.times));
  draw_legend(canvas, legend);
  return std::move(canvas);
}

Canvas compose_space(const RegistrationPicture& picture, bool narrow) {
  Plan plan = narrow ? arrange_space({}, data_ranges(picture, 0.4), narrow_arrangement())
                     : arrange_space(titles_of(picture), data_ranges(picture, 0.4));
  const Figures figures = plan_figures(picture, scale_of(plan.views[0]));
  const Figure& figure = figures.source;
  draw_displacements(plan.canvas, plan.side, picture.source.points, picture.result, figure,
                     {picture.surface_before, picture.triangles});
  bool any_hidden = false;
  for (const View& view : plan.views) {
    draw_frame(plan.canvas, view, axis_names(view), true);
    const SurfaceParts surface{picture.surface_after, picture.triangles};
    const std::vector<int> hidden = hidden_points(view, surface, picture.result);
    const SplitFigure parts = split(figure, hidden, picture.result.cols());
    any_hidden = any_hidden || !hidden.empty();
    draw_shape(plan.canvas, view.pixels(picture.result), parts.hidden, colour::kResult);
    draw_surface(plan.canvas, view, surface);
    plan.canvas.lines(trace(figure, false, view.pixels(picture.source.points)),
                      {faded(colour::kSource, 0.4), Marks(figure).outline});
    const Figure target =
        picture.corresponds ? split(figures.target, hidden, picture.result.cols()).seen : figures.target;
    draw_registration(plan.canvas, view, picture, {parts.seen, target});
  }
  std::vector<LegendEntry> legend = legend_of_shapes(figures, picture);
  legend.push_back(arrow_entry("displacement", colour::kMomentum));
  if (any_hidden) legend.push_back(dot_entry("behind the surface", {faded(colour::kResult, 0.75)}));
  legend.push_back(legend_of_time(picture.times));
  draw_legend(plan.canvas, legend);
  return std::move(plan.canvas);
}

constexpr double kNarrowHeight = 420;  // of each panel on a narrow screen

Canvas compose_line(const RegistrationPicture& picture, bool narrow) {
  const bool has_map = picture.source.count() >= kManyOnLine && picture.corresponds;
  const double width = narrow ? kNarrowWidth : kWidth;
  const double map_height = narrow ? 2 * kNarrowHeight + kHeading + kTicRoom : 560;
  const double panel_height = narrow ? kNarrowHeight : has_map ? 420 : 760;
  const Interval x = data_ranges(picture, 1)[0];
  const double start = picture.times.front(), end = picture.times.back();
  const Interval t = Interval{start, end}.with_span((1 + 2 * kMargin) * (end - start));
  const double left = kEdge + left_number_width(x, panel_height);
  const double height =
      kHeading + panel_height + kTicRoom + kLegendRoom + (has_map ? map_height + kHeading + kTicRoom : 0);
  Canvas canvas = titled_canvas(narrow ? Titles() : titles_of(picture), left, width, height);
  const View view{{left, kTicRoom + kLegendRoom, width - kEdge - left, panel_height}, t, x};
  const Figures figures = plan_figures(picture, panel_height / x.span());
  const Figure& figure = figures.source;
  if (has_map)
    draw_map_panels(canvas, {left, view.box.bottom + panel_height + kHeading + kTicRoom, view.box.width, map_height},
                    narrow, picture, figure);
  draw_frame(canvas, view, "Position x over time t, a colour for each landmark", true);
  canvas.lines(view.pixels(picture.grid_paths), kGridStroke);

  const std::vector<Colour> colours = colours_by_position(picture.source.points);
  std::vector<int> landmarks(colours.size());
  std::iota(landmarks.begin(), landmarks.end(), 0);
  const auto kept = thin_paths(picture.trajectory, landmarks, picture.times, static_cast<std::size_t>(kWidth));
  for (const int a : landmarks) {
    const Points path = values_over_time(picture.trajectory, picture.times, a, 0, kept[a]);
    canvas.lines({view.pixels(path)}, {colours[a], Marks(figure).path});
  }
  const auto at = [&](double time, const Points& positions) {
    Points points(2, positions.cols());
    points << Eigen::RowVectorXd::Constant(positions.cols(), time), positions;
    return view.pixels(points);
  };
  draw_shape(canvas, at(start, picture.source.points), figure, colour::kSource);
  draw_target(canvas, at(end, picture.target.points), figures);
  draw_shape(canvas, at(end, picture.result), figure, colour::kResult);
  draw_doubts(canvas, at(end, picture.result), picture.doubted, Marks(figure).ring);
  std::vector<LegendEntry> legend = legend_of_shapes(figures, picture);
  if (!picture.grid_paths.empty()) legend.push_back(line_entry("paths of material points", colour::kGrid));
  draw_legend(canvas, legend);
  return canvas;
}

void check_verdicts(const RegistrationPicture& picture) {
  const int n = picture.source.count();
  const auto check_landmark = [&](int a) {
    if (a < 0 || a >= n) throw InputError(fmt::format("registration picture: the source has no landmark {}", a));
  };
  for (const int a : picture.doubted) check_landmark(a);
  for (const auto& triangle : picture.map_triangles)
    for (const int a : triangle) check_landmark(a);
  const auto check_map = [&](const Eigen::VectorXd& shares, const char* what) {
    if (shares.size() > 0 && (shares.size() != n || !shares.allFinite() || shares.minCoeff() < 0))
      throw InputError(fmt::format("registration picture: the {} needs a number of 0 or more for each landmark", what));
  };
  check_map(picture.action, "action");
  check_map(picture.energy, "energy");
}

void check(const RegistrationPicture& picture) {
  const Checks checks("registration picture");
  const Landmarks& source = picture.source;
  checks.shape(source, "the source");
  checks.incomplete_shape(picture.target, source.dimension(), "the target");
  if (picture.corresponds) checks.count(picture.target.points, source, "the source", "the target");
  checks.landmarks(picture.result, source, "the source", "the result");
  check_verdicts(picture);
  checks.times(picture.times, picture.trajectory.size(), "the trajectory");
  checks.trajectory(picture.trajectory, source, "the source", "trajectory");
  const auto check_lines = [&](const std::vector<Points>& lines, Eigen::Index rows, const std::string& what) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      checks.points(lines[i], rows, fmt::format("{} line {}", what, i + 1));
  };
  check_lines(picture.grid_before, source.dimension(), "undeformed grid");
  check_lines(picture.grid_after, source.dimension(), "deformed grid");
  check_lines(picture.grid_paths, 2, "material path");
  for (const auto& triangle : picture.triangles)
    for (const int corner : triangle)
      if (corner < 0 || corner >= picture.surface_before.cols() || corner >= picture.surface_after.cols())
        throw InputError(fmt::format("registration picture: its surface has no vertex {}", corner));
  if (!picture.triangles.empty()) {
    checks.points(picture.surface_before, 3, "surface of the source");
    checks.points(picture.surface_after, 3, "surface of the result");
  }
}

}  // namespace

void write_registration_picture(const RegistrationPicture& picture, const PictureFiles& files) {
  check(picture);
  const int d = picture.source.dimension();
  write_layouts(files, [&](bool narrow) {
    return d == 1   ? compose_line(picture, narrow)
           : d == 2 ? compose_plane(picture, narrow)
                    : compose_space(picture, narrow);
  });
}

}  // namespace pulson::draw
