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

const double kQuantile = -2 * std::log(1 - kEllipsePart);  // of a χ² distribution of two degrees of freedom
constexpr int kCorners = 72;                               // of an ellipse
constexpr std::size_t kMeanVertices = 60000;               // of all mean paths
constexpr std::size_t kFanVertices = 60000;                // of all sample paths
constexpr double kFanFade = 0.8, kEllipseFade = 0.85, kOutlineFade = 0.45;
constexpr std::size_t kFewEllipses = 8;

/// The ranges of the start, the mean paths and the ellipses, with a margin.
std::vector<Interval> data_ranges(const EnsemblePicture& picture) {
  std::vector<const Points*> sets = {&picture.start.points};
  for (const Points& points : picture.mean) sets.push_back(&points);
  Points low = picture.mean.back(), high = low;  // of the ellipses
  for (Eigen::Index a = 0; a < low.cols(); ++a) {
    const auto variances = picture.covariances[static_cast<std::size_t>(a)].diagonal().array().max(0);
    low.col(a).array() -= (kQuantile * variances).sqrt();
    high.col(a).array() += (kQuantile * variances).sqrt();
  }
  sets.insert(sets.end(), {&low, &high});
  return ranges_of(sets, picture.start.dimension(), 0.15);
}

void draw_fan(Canvas& canvas, const View& view, const EnsemblePicture& picture, std::size_t vertices) {
  std::vector<Points> lines;
  for (const std::vector<Points>& path : picture.paths)
    for (Eigen::Index a = 0; a < picture.start.points.cols(); ++a) lines.push_back(view.pixels(path_of(path, a)));
  simplify_lines(lines, vertices);
  canvas.look_through(view.box);
  canvas.lines(std::move(lines), {faded(colour::kSource, kFanFade), 1.2});
  canvas.look_through({});
}

void draw_ellipses(Canvas& canvas, const View& view, const EnsemblePicture& picture) {
  const std::vector<Points> outlines = view.pixels(ellipses(picture, view.row_x, view.row_y));
  const bool are_few = outlines.size() <= kFewEllipses;  // many would darken one another
  if (are_few)
    for (const Points& outline : outlines) canvas.areas({outline}, faded(colour::kTarget, kEllipseFade));
  for (const Points& outline : outlines)
    canvas.lines({outline}, {are_few ? colour::kTarget : faded(colour::kTarget, kOutlineFade), 1.4});
}

/// A dot of the mean that an ellipse, of the median radius, surrounds in sight. In pixels.
double largest_dot(const EnsemblePicture& picture, const View& view) {
  constexpr double kOfRadius = 0.5, kLeast = 2;
  std::vector<double> radii;
  for (const Eigen::MatrixXd& covariance : picture.covariances)
    radii.push_back(std::sqrt(kQuantile * covariance.trace() / static_cast<double>(covariance.rows())));
  return std::max(kLeast, kOfRadius * median(std::move(radii)) * scale_of(view));
}

Canvas compose(const EnsemblePicture& picture, bool narrow) {
  const std::vector<Interval> ranges = data_ranges(picture);
  const bool in_plane = picture.start.dimension() == 2;
  const Titles titles = narrow ? Titles() : Titles{picture.title, picture.subtitle};
  const Arrangement arrangement = narrow ? narrow_arrangement() : Arrangement{.tallest = 900, .all_numbered = true};
  const View view_in_plane{.box = {}, .x = ranges[0], .y = ranges[1], .y_down = picture.start.frame.y_down};
  Plan plan = in_plane ? arrange(titles, {view_in_plane}, arrangement) : arrange_space(titles, ranges, arrangement);
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
  legend.push_back(ring_entry(fmt::format("ellipse of {:.0f} %", 100 * kEllipsePart), colour::kTarget));
  if (!picture.paths.empty())
    legend.push_back(
        line_entry(fmt::format("{} sample paths", picture.paths.size()), faded(colour::kSource, kFanFade / 2)));
  if (!in_plane) legend.push_back(arrow_entry("displacement of the mean", colour::kMomentum));
  legend.push_back(legend_of_time(picture.times));
  legend.back().text_before = "mean " + legend.back().text_before;
  draw_legend(canvas, legend);
  return std::move(plan.canvas);
}

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
  const std::array<int, 2> rows = {row_x, row_y};
  const Eigen::RowVectorXd angles = Eigen::RowVectorXd::LinSpaced(kCorners + 1, 0, 2 * std::numbers::pi);
  Points circle(2, angles.cols()), outline;
  circle << angles.array().cos(), angles.array().sin();
  std::vector<Points> outlines;
  for (std::size_t a = 0; a < picture.covariances.size(); ++a) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(Eigen::Matrix2d(picture.covariances[a](rows, rows)));
    const Eigen::Vector2d radii = (kQuantile * axes.eigenvalues().cwiseMax(0)).cwiseSqrt();
    outline = picture.mean.back().col(static_cast<Eigen::Index>(a)).replicate(1, circle.cols());
    outline(rows, Eigen::all) += axes.eigenvectors() * radii.asDiagonal() * circle;
    outlines.push_back(outline);
  }
  return outlines;
}

void write_ensemble_picture(const EnsemblePicture& picture, const PictureFiles& files) {
  check(picture);
  write_layouts(files, [&](bool narrow) { return compose(picture, narrow); });
}

}  // namespace pulson::draw
