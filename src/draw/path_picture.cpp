#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "path_panels.hpp"
#include "pulson/draw/pictures.hpp"
#include "space_panels.hpp"

namespace pulson::draw {
namespace {

// In all panels together; an SVG takes some 16 bytes for a vertex.
constexpr std::size_t kPanelPathVertices = 30000;  // of paths coloured by time; those where a colour ends count twice
constexpr std::size_t kEndVertices = 16000;        // of the ends of all paths but the first
constexpr std::size_t kMostPaths = 500;            // coloured by time

constexpr std::size_t kMostColumns = 3;  // paths side by side
constexpr int kFewLandmarks = 4;         // whose momenta in the plane and in space are drawn over time
constexpr double kStripHeight = 280;     // of those momenta
constexpr double kLongestArrow = 0.15;   // of the widest range
constexpr std::size_t kMostCloudLayers = 24;
constexpr double kThickestPath = 2.2;

Titles titles_of(const PathPicture& picture) { return {picture.title, picture.subtitle}; }

bool has_few_landmarks(const PathPicture& picture) { return picture.start.count() <= kFewLandmarks; }

/// The ranges of all that is drawn, with a margin; none is less than `flattest` of the widest. `more`: other points.
std::vector<Interval> data_ranges(const PathPicture& picture, const Ends& ends, const Points& more, double flattest) {
  std::vector<const Points*> sets{&picture.start.points, &more};
  for (const Points& points : picture.positions.front()) sets.push_back(&points);
  for (const std::size_t m : ends.others) sets.push_back(&picture.positions[m].back());
  return ranges_of(sets, picture.start.dimension(), flattest);
}

double longest_momentum(const PathPicture& picture) {
  const Points& p = picture.momenta.front().front();
  double longest = 0;
  for (Eigen::Index a = 0; a < p.cols(); ++a) longest = std::max(longest, p.col(a).stableNorm());
  return longest;
}

/// Where arrows of the first momenta end; d×0 where all of these are zero.
Points arrow_tips(const PathPicture& picture) {
  Points none(picture.start.dimension(), 0);
  const double longest = longest_momentum(picture);
  if (longest == 0) return none;
  double widest = 0;
  for (const Interval& range : data_ranges(picture, {}, none, 1)) widest = std::max(widest, range.span());
  return picture.start.points + kLongestArrow * widest * (picture.momenta.front().front() / longest);
}

/// The figure of the start; of very many landmarks, some have a path.
Figure plan_start(const PathPicture& picture, const Plan& plan) {
  Figure figure = plan_figure(picture.start, scale_of(plan.views.front()));
  const std::size_t most = kMostPaths / (picture.start.dimension() == 2 ? 1 : plan.views.size());
  std::vector<int> with_path;
  for (const std::size_t i : spread_indices(figure.with_path.size(), most)) with_path.push_back(figure.with_path[i]);
  figure.with_path = std::move(with_path);
  return figure;
}

/// All outlines in the colour, or in those of the groups where there are several.
void draw_outlines(Canvas& canvas, const Points& pixels, const Figure& figure, const Colour& colour,
                   double transparency, double width) {
  for (std::size_t group = 0; group < figure.groups.size(); ++group) {
    const Stroke stroke{faded(figure.names.empty() ? colour : group_colour(group), transparency), width};
    canvas.lines(trace(figure, false, pixels, group), stroke);
    canvas.lines(trace(figure, true, pixels, group), stroke);
  }
}

/// The start in small marks over its outlines; few landmarks have the colours of their momenta.
void draw_small_start(Canvas& canvas, const View& view, const PathPicture& picture, const Figure& figure) {
  const Points start = view.pixels(picture.start.points);
  draw_start(canvas, start, figure);
  if (!has_few_landmarks(picture)) return;
  const std::vector<Colour> colours = landmark_colours(picture);
  for (Eigen::Index a = 0; a < start.cols(); ++a) canvas.dots(start.col(a), 0.8 * Marks(figure).dot, colours[a]);
}

void draw_first_end(Canvas& canvas, const View& view, const PathPicture& picture, const Figure& figure) {
  draw_shape(canvas, view.pixels(picture.positions.front().back()), figure, colour::kResult);
}

/// The ends of other paths on few landmarks, in the colours of their momenta.
void draw_end_clouds(Canvas& canvas, const View& view, const PathPicture& picture,
                     const std::vector<std::size_t>& paths, double radius, double transparency) {
  // Dots darken one another where they lie in different layers; a layer for each dot would fill the file.
  const std::size_t batch = paths.size() / kMostCloudLayers + 1;
  const std::vector<Colour> colours = landmark_colours(picture);
  for (std::size_t begin = 0; begin < paths.size(); begin += batch) {
    const std::size_t end = std::min(begin + batch, paths.size());
    for (int a = 0; a < picture.start.count(); ++a) {
      Points dots(picture.start.dimension(), end - begin);
      for (std::size_t i = begin; i < end; ++i) dots.col(i - begin) = picture.positions[paths[i]].back().col(a);
      canvas.dots(view.pixels(dots), radius, faded(colours[a], transparency));
    }
  }
}

/// The ends of other paths, faintly; landmarks without an outline as dots.
void draw_other_ends(Canvas& canvas, const View& view, const PathPicture& picture, const Ends& ends,
                     const Figure& figure) {
  const double transparency = 1 - opacity(ends.others.size()), radius = 0.6 * Marks(figure).dot;
  if (has_few_landmarks(picture)) return draw_end_clouds(canvas, view, picture, ends.others, radius, transparency);
  for (const std::size_t m : ends.others) {
    const Points end = view.pixels(picture.positions[m].back());
    draw_outlines(canvas, end, figure, colour::kResult, transparency, 1.2);
    if (figure.outlines.empty())
      canvas.dots(end(Eigen::all, figure.marked), radius, faded(colour::kResult, transparency));
  }
}

/// The first path over the start, and its end.
void draw_first_path(Canvas& canvas, const View& view, const PathPicture& picture, const Figure& figure,
                     std::size_t vertices) {
  const Marks marks(figure);
  draw_outlines(canvas, view.pixels(picture.start.points), figure, colour::kSource, 0.4, marks.outline);
  draw_paths_by_time(canvas, view, {picture.positions.front(), picture.times}, figure,
                     std::min(marks.path, kThickestPath), vertices);
  draw_small_start(canvas, view, picture, figure);
  draw_first_end(canvas, view, picture, figure);
}

void draw_start_with_momenta(Canvas& canvas, const View& view, const PathPicture& picture, const Figure& figure,
                             const Points& tips) {
  draw_frame(canvas, view, "Start", true);
  const Points start = view.pixels(picture.start.points);
  draw_shape(canvas, start, figure, colour::kSource);
  if (tips.cols() > 0)
    canvas.arrows(start(Eigen::all, figure.with_path), view.pixels(tips)(Eigen::all, figure.with_path),
                  {colour::kMomentum, Marks(figure).stroke});
  draw_names(canvas, start, figure, picture.start);
}

void draw_ends(Canvas& canvas, const View& view, const PathPicture& picture, const Ends& ends, const Figure& figure,
               bool left_numbers) {
  draw_frame(canvas, view, "Ends of all paths", left_numbers);
  draw_outlines(canvas, view.pixels(picture.start.points), figure, colour::kSource, 0.2, Marks(figure).outline);
  draw_other_ends(canvas, view, picture, ends, figure);
  draw_small_start(canvas, view, picture, figure);
  draw_first_end(canvas, view, picture, figure);
}

/// ", 500 of 2000 landmarks" where not all that are marked have a path.
std::string remark(const PathPicture& picture, const Figure& figure) {
  if (figure.with_path.size() >= figure.marked.size()) return "";
  return ", " + some_of(figure.with_path.size(), static_cast<std::size_t>(picture.start.count()), "landmarks");
}

std::vector<LegendEntry> legend_of(const PathPicture& picture, const Ends& ends, const Figure& figure) {
  std::vector<LegendEntry> legend =
      has_few_landmarks(picture) ? legend_of_landmarks(picture) : legend_of_shape(figure, colour::kSource, "start");
  if (figure.names.empty()) legend.push_back(legend_of_shape(figure, colour::kResult, "end").front());
  if (const std::size_t all = picture.positions.size() - 1; all > 0) {
    const std::string what = fmt::format("other {}{}", has_few_landmarks(picture) ? "path" : "end", all > 1 ? "s" : "");
    std::string text = some_of(ends.others.size() + ends.outside, all, what);
    if (ends.outside > 0) text += fmt::format(", {} of them far outside", ends.outside);
    const Colour faint = faded(colour::kResult, 0.6);
    legend.push_back(figure.outlines.empty() ? dot_entry(text, {faint}) : line_entry(text, faint));
  }
  legend.push_back(legend_of_time(picture.times));
  return legend;
}

/// The views of the positions, and the momenta of few landmarks in a strip below these, or in one strip for each
/// component where the views are as narrow as a phone.
Plan arrange_above_momenta(const PathPicture& picture, Arrangement arrangement,
                           const std::function<Plan(const Arrangement&)>& arranged) {
  if (!has_few_landmarks(picture)) return arranged(arrangement);
  const bool narrow = arrangement.most_width == kNarrowWidth;
  const TimePanels momenta = component_panels(picture, narrow);
  const double height = momenta.height_of(kStripHeight);
  arrangement.tallest *= 0.7;
  arrangement.number_room = momenta.number_room(kStripHeight);
  arrangement.room_below = kHeading + height + kTicRoom;
  arrangement.least_width = arrangement.most_width;
  Plan plan = arranged(arrangement);
  const double left = plan.views.front().box.left;
  momenta.draw(plan.canvas, {left, kLegendRoom + kTicRoom, plan.canvas.width() - kEdge - left, height});
  return plan;
}

Canvas compose_paths_on_line(const PathPicture& picture, bool narrow) {
  const double position_height = narrow ? 360 : 480, momentum_height = narrow ? 280 : 360;
  const std::size_t paths = picture.positions.size();
  const std::size_t columns = paths <= kMostColumns && picture.start.count() > 1 ? paths : 1;
  const TimePanels positions = line_panels(picture, false, columns, narrow),
                   momenta = line_panels(picture, true, columns, narrow);
  const double left = kEdge + std::max(positions.number_room(position_height), momenta.number_room(momentum_height));
  const double width = narrow ? kNarrowWidth : kWidth, bottom = kLegendRoom + kTicRoom;
  const double upper_height = positions.height_of(position_height), lower_height = momenta.height_of(momentum_height);
  const double upper = bottom + lower_height + kHeading + kTicRoom;
  Canvas canvas = titled_canvas(narrow ? Titles() : titles_of(picture), left, width, upper + upper_height + kHeading);
  positions.draw(canvas, {left, upper, width - kEdge - left, upper_height});
  momenta.draw(canvas, {left, bottom, width - kEdge - left, lower_height});
  draw_legend(canvas, legend_of_landmarks(picture));
  return canvas;
}

Canvas compose_paths_in_plane(const PathPicture& picture, bool narrow) {
  const bool alone = picture.positions.size() == 1, few = has_few_landmarks(picture);
  const Points tips = alone && !few ? arrow_tips(picture) : Points(2, 0);
  const Ends ends = choose_ends(picture, kEndVertices);
  const std::vector<Interval> ranges = data_ranges(picture, ends, tips, 0.15);
  const View view{.box = {}, .x = ranges[0], .y = ranges[1], .y_down = picture.start.frame.y_down};
  const bool stacked = narrow || view.x.span() > 2.2 * view.y.span();
  std::vector<View> views(alone && few ? 1 : 2, view);
  Plan plan = arrange_above_momenta(
      picture, narrow ? narrow_arrangement() : Arrangement{stacked, stacked ? 560.0 : 900.0, stacked},
      [&](const Arrangement& arrangement) {
        return arrange(narrow ? Titles() : titles_of(picture), views, arrangement);
      });
  Canvas& canvas = plan.canvas;
  const Figure figure = plan_start(picture, plan);

  const View& path_view = alone ? plan.views.back() : plan.views.front();
  draw_frame(canvas, path_view, (alone ? "Sample path" : "Sample path 1") + remark(picture, figure),
             stacked || !alone || few);
  draw_first_path(canvas, path_view, picture, figure, kPanelPathVertices);
  if (!alone) draw_ends(canvas, plan.views.back(), picture, ends, figure, stacked);
  if (alone && !few) draw_start_with_momenta(canvas, plan.views.front(), picture, figure, tips);

  std::vector<LegendEntry> legend = legend_of(picture, ends, figure);
  if (tips.cols() > 0)
    legend.push_back(
        arrow_entry(fmt::format("momentum, longest {:.3g}", longest_momentum(picture)), colour::kMomentum));
  draw_legend(canvas, legend);
  return std::move(canvas);
}

Canvas compose_paths_in_space(const PathPicture& picture, bool narrow) {
  const Ends ends = choose_ends(picture, kEndVertices / 3);
  const std::vector<Interval> ranges = data_ranges(picture, ends, Points(3, 0), 0.4);
  const Arrangement wanted = narrow ? narrow_arrangement() : Arrangement();
  Plan plan = arrange_above_momenta(picture, wanted, [&](const Arrangement& arrangement) {
    return arrange_space(narrow ? Titles() : titles_of(picture), ranges, arrangement);
  });
  const Figure figure = plan_start(picture, plan);
  draw_displacements(plan.canvas, plan.side, picture.start.points, picture.positions.front().back(), figure);
  for (std::size_t i = 0; i < plan.views.size(); ++i) {
    const View& view = plan.views[i];
    draw_frame(plan.canvas, view, axis_names(view) + (i == 0 ? remark(picture, figure) : ""), true);
    draw_other_ends(plan.canvas, view, picture, ends, figure);
    draw_first_path(plan.canvas, view, picture, figure, kPanelPathVertices / plan.views.size());
  }
  std::vector<LegendEntry> legend = legend_of(picture, ends, figure);
  legend.push_back(arrow_entry("displacement of path 1", colour::kMomentum));
  draw_legend(plan.canvas, legend);
  return std::move(plan.canvas);
}

void check(const PathPicture& picture) {
  const Checks checks("path picture");
  checks.shape(picture.start, "the start");
  const std::size_t paths = picture.positions.size();
  if (paths == 0) checks.refuse("there are no paths");
  if (picture.momenta.size() != paths)
    checks.refuse(fmt::format("{} paths of momenta for {} of positions", picture.momenta.size(), paths));
  for (const bool momenta : {false, true})
    for (std::size_t m = 0; m < paths; ++m) {
      const std::vector<Points>& entries = momenta ? picture.momenta[m] : picture.positions[m];
      const std::string name = fmt::format("{} of path {}", momenta ? "momenta" : "positions", m + 1);
      checks.times(picture.times, entries.size(), "the " + name);
      checks.trajectory(entries, picture.start, "the start", name + ",");
    }
}

}  // namespace

void write_path_picture(const PathPicture& picture, const PictureFiles& files) {
  check(picture);
  const int d = picture.start.dimension();
  write_layouts(files, [&](bool narrow) {
    return d == 1   ? compose_paths_on_line(picture, narrow)
           : d == 2 ? compose_paths_in_plane(picture, narrow)
                    : compose_paths_in_space(picture, narrow);
  });
}

}  // namespace pulson::draw
