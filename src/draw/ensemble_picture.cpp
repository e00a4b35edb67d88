#include "draw/ensemble_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "space_panels.hpp"

namespace pulson::draw {
namespace {

constexpr int kCorners = 72;                  // of an ellipse
constexpr std::size_t kMeanVertices = 60000;  // of all mean paths
constexpr std::size_t kFanVertices = 60000;   // of all sample paths
constexpr double kFanFade = 0.8;
constexpr double kEllipseFade = 0.85;
constexpr std::size_t kFewEllipses = 8;
constexpr double kOutlineFade = 0.45;

/// The ellipse of one landmark in the plane of a view, in length units: the quantile of a χ² distribution of two
/// degrees of freedom is −2 ln(1 − part).
Points ellipse(const Eigen::VectorXd& middle, const Eigen::MatrixXd& covariance, const std::array<int, 2>& rows) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(Eigen::Matrix2d(covariance(rows, rows)));
  const Eigen::Vector2d radii = (-2 * std::log(1 - kEllipsePart) * axes.eigenvalues().cwiseMax(0)).cwiseSqrt();
  Points outline = middle.replicate(1, kCorners + 1);
  for (int i = 0; i <= kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    const Eigen::Vector2d place =
        axes.eigenvectors() * radii.cwiseProduct(Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    outline(rows[0], i) += place.x();
    outline(rows[1], i) += place.y();
  }
  return outline;
}

std::vector<Points> ellipses(const EnsemblePicture& picture, const View& view) {
  return draw::ellipses(picture, view.row_x, view.row_y);
}

std::vector<View> views_of(const EnsemblePicture& picture) {
  if (picture.start.dimension() == 3) return coordinate_planes(std::vector<Interval>(3, Interval{0, 1}));
  return {{.box = {}, .x = {0, 1}, .y = {0, 1}, .y_down = picture.start.y_down}};
}

/// The ranges of the start, the mean paths and the ellipses, with a margin.
std::vector<Interval> data_ranges(const EnsemblePicture& picture) {
  std::vector<Points> outlines;
  for (const View& view : views_of(picture))
    for (Points& outline : ellipses(picture, view)) outlines.push_back(std::move(outline));
  std::vector<const Points*> sets = {&picture.start.points};
  for (const Points& points : picture.mean) sets.push_back(&points);
  for (const Points& outline : outlines) sets.push_back(&outline);
  std::vector<Interval> ranges;
  for (int row = 0; row < picture.start.dimension(); ++row) ranges.push_back(range_of(sets, row));
  return with_margins(std::move(ranges), 0.15);
}

bool is_in(const Box& box, const Eigen::Vector2d& place) {
  return place.x() >= box.left && place.x() <= box.left + box.width && place.y() >= box.bottom &&
         place.y() <= box.bottom + box.height;
}

/// The parts of a line 2×M whose vertices are in the box.
void append_parts_in(const Box& box, const Points& line, std::vector<Points>& parts) {
  for (Eigen::Index first = 0; first < line.cols(); ++first) {
    Eigen::Index end = first;
    while (end < line.cols() && is_in(box, line.col(end))) ++end;
    if (end - first > 1) parts.emplace_back(line.middleCols(first, end - first));
    first = end;
  }
}

void draw_fan(Canvas& canvas, const View& view, const EnsemblePicture& picture, std::size_t vertices) {
  std::vector<Points> lines;
  for (const std::vector<Points>& path : picture.paths)
    for (Eigen::Index a = 0; a < picture.start.points.cols(); ++a) {
      Points line(picture.start.points.rows(), static_cast<Eigen::Index>(path.size()));
      for (std::size_t k = 0; k < path.size(); ++k) line.col(static_cast<Eigen::Index>(k)) = path[k].col(a);
      append_parts_in(view.box, view.pixels(line), lines);
    }
  simplify_lines(lines, vertices);
  canvas.lines(lines, {faded(colour::kSource, kFanFade), 1.2});
}

void draw_ellipses(Canvas& canvas, const View& view, const EnsemblePicture& picture) {
  const std::vector<Points> outlines = view.pixels(ellipses(picture, view));
  const bool are_few = outlines.size() <= kFewEllipses;  // many would darken one another
  if (are_few)
    for (const Points& outline : outlines) canvas.areas({outline}, faded(colour::kTarget, kEllipseFade));
  for (const Points& outline : outlines)
    canvas.lines({outline}, {are_few ? colour::kTarget : faded(colour::kTarget, kOutlineFade), 1.4});
}

/// A dot of the mean that an ellipse, of the median radius, surrounds in sight. In pixels.
double largest_dot(const EnsemblePicture& picture, const View& view) {
  constexpr double kOfRadius = 0.5, kLeast = 2;
  const double quantile = -2 * std::log(1 - kEllipsePart);
  std::vector<double> radii;
  for (const Eigen::MatrixXd& covariance : picture.covariances)
    radii.push_back(std::sqrt(quantile * covariance.trace() / static_cast<double>(covariance.rows())));
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  return std::max(kLeast, kOfRadius * *middle * scale_of(view));
}

Canvas compose(const EnsemblePicture& picture) {
  const std::vector<Interval> ranges = data_ranges(picture);
  const bool in_plane = picture.start.dimension() == 2;
  const Titles titles{picture.title, picture.subtitle};
  Plan plan = in_plane ? arrange(titles, {{.box = {}, .x = ranges[0], .y = ranges[1], .y_down = picture.start.y_down}},
                                 {.tallest = 900, .all_numbered = true})
                       : arrange_space(titles, ranges);
  Canvas& canvas = plan.canvas;
  const Figure figure = plan_figure(picture.start, scale_of(plan.views.front()));
  if (!in_plane) draw_displacements(canvas, plan.side, picture.start.points, picture.mean.back(), figure);
  for (const View& view : plan.views) {
    draw_fan(canvas, view, picture, kFanVertices / plan.views.size());
    draw_ellipses(canvas, view, picture);
    draw_start(canvas, view.pixels(picture.start.points), figure);
    draw_paths_by_time(canvas, view, {picture.mean, picture.times}, figure, Marks(figure).path,
                       kMeanVertices / plan.views.size());
    draw_shape(canvas, view.pixels(picture.mean.back()), figure, colour::kResult, largest_dot(picture, view));
    draw_frame(canvas, view,
               in_plane ? fmt::format("Mean shape at t = {:.4g}", picture.times.back()) : axis_names(view), true);
  }
  std::vector<LegendEntry> legend =
      legend_of_shape(figure, colour::kResult, fmt::format("mean at t = {:.4g}", picture.times.back()));
  legend.push_back({Sample::kRing, colour::kTarget, fmt::format("ellipse of {:.0f} %", 100 * kEllipsePart), ""});
  if (!picture.paths.empty())
    legend.push_back({Sample::kLine, faded(colour::kSource, kFanFade / 2),
                      fmt::format("{} sample paths", picture.paths.size()), ""});
  if (!in_plane) legend.push_back({Sample::kArrow, colour::kMomentum, "displacement of the mean", ""});
  legend.push_back(legend_of_time(picture.times));
  legend.back().text = "mean " + legend.back().text;
  draw_legend(canvas, legend);
  return std::move(plan.canvas);
}

}  // namespace
namespace {

void check(const EnsemblePicture& picture) {
  const Checks checks("ensemble picture");
  checks.shape(picture.start, "the start");
  const Eigen::Index d = picture.start.dimension();
  if (d < 2) checks.refuse("the start is in 1D");
  checks.times(picture.times, picture.mean.size(), "the mean");
  checks.trajectory(picture.mean, picture.start, "the start", "mean");
  if (picture.covariances.size() != static_cast<std::size_t>(picture.start.count()))
    checks.refuse(fmt::format("{} covariances of {} landmarks", picture.covariances.size(), picture.start.count()));
  for (std::size_t a = 0; a < picture.covariances.size(); ++a) {
    if (picture.covariances[a].cols() != d) checks.refuse(fmt::format("covariance {} is not {}×{}", a + 1, d, d));
    checks.points(picture.covariances[a], d, fmt::format("covariance {}", a + 1));
  }
  for (std::size_t m = 0; m < picture.paths.size(); ++m)
    checks.trajectory(picture.paths[m], picture.start, "the start", fmt::format("path {},", m + 1));
}

}  // namespace

std::vector<Points> ellipses(const EnsemblePicture& picture, int row_x, int row_y) {
  std::vector<Points> outlines;
  for (Eigen::Index a = 0; a < picture.mean.back().cols(); ++a)
    outlines.push_back(
        ellipse(picture.mean.back().col(a), picture.covariances[static_cast<std::size_t>(a)], {row_x, row_y}));
  return outlines;
}

void write_ensemble_picture(const EnsemblePicture& picture, const PictureFiles& files) {
  check(picture);
  compose(picture).write(files);
}

}  // namespace pulson::draw
