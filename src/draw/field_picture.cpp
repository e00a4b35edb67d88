#include "draw/field_picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"
#include "path_panels.hpp"

namespace pulson::draw {
namespace {

constexpr double kFieldHeight = 620;               // of the panels on a line
constexpr double kSideWidth = 250, kSideGap = 46;  // of the panels beside the map
constexpr int kMapColumns = 800, kMapRows = 500;   // of its pixels
constexpr int kPlanePixels = 320;                  // along the longer side of a panel in the plane
constexpr int kArrows = 24;                        // likewise
constexpr double kLeastArrow = 0.02;               // of the longest; shorter ones are dots
constexpr std::size_t kFieldPathVertices = 60000;  // of all landmarks' paths
const Stroke kFieldPath{{colour::kResult.rgb, 0.55}, 1.3};
const Stroke kFieldArrow{{colour::kResult.rgb, 0.8}, 1.2};
const Stroke kStem{colour::kMomentum, 2.2};

/// Blue, white, red, from 0 to 1.
Colour signed_colour(double part) { return colour_at(kBlueWhiteRed, part); }
/// White to red.
Colour speed_colour(double part) { return signed_colour(0.5 + part / 2); }

/// Where a value lies among increasing ones, as a fractional index.
template <class Values>
double place_among(const Values& values, double value) {
  const auto after = std::upper_bound(values.begin() + 1, values.end() - 1, value);
  const auto before = after - 1;
  return static_cast<double>(before - values.begin()) + std::clamp((value - *before) / (*after - *before), 0.0, 1.0);
}

/// A number between those of a table at fractional indices.
double bilinear(const Eigen::MatrixXd& table, double row, double column) {
  const auto i = std::min(static_cast<Eigen::Index>(row), table.rows() - 2);
  const auto j = std::min(static_cast<Eigen::Index>(column), table.cols() - 2);
  const double s = row - static_cast<double>(i), t = column - static_cast<double>(j);
  return (1 - s) * ((1 - t) * table(i, j) + t * table(i, j + 1)) +
         s * ((1 - t) * table(i + 1, j) + t * table(i + 1, j + 1));
}

/// The values of a table as colours of their part of `most`: rows of the table to the right, its columns upwards, or
/// downwards. @param right, up of the pixels, fractional indices
template <class ColourOf>
Raster coloured(const Eigen::MatrixXd& table, const std::vector<double>& right, const std::vector<double>& down,
                double most, const ColourOf& colour_of) {
  Raster raster{static_cast<int>(right.size()), static_cast<int>(down.size()), {}};
  for (const double column : down)
    for (const double row : right) {
      const Colour colour = colour_of(bilinear(table, row, column) / most);
      raster.rgba.insert(raster.rgba.end(), colour.rgb.begin(), colour.rgb.end());
      raster.rgba.push_back(255);
    }
  return raster;
}

/// Fractional indices among `values` of the middles of `count` pixels between the first and the last.
template <class Values>
std::vector<double> pixel_places(const Values& values, int count, bool backwards = false) {
  const double first = *values.begin(), last = *(values.end() - 1);
  std::vector<double> places;
  for (int i = 0; i < count; ++i) {
    const double part = (i + 0.5) / count;
    places.push_back(place_among(values, first + (backwards ? 1 - part : part) * (last - first)));
  }
  return places;
}

Interval interval_of(const Eigen::VectorXd& axis) { return {axis[0], axis[axis.size() - 1]}; }

double largest_norm(const std::vector<Points>& vectors) {
  double most = 0;
  for (const Points& each : vectors) most = std::max(most, each.colwise().norm().maxCoeff());
  return most > 0 ? most : 1;
}

// ---- on a line

Interval range_with_zero(const std::vector<Points>& values) {
  std::vector<const Points*> sets;
  for (const Points& each : values) sets.push_back(&each);
  const Points zero = Points::Zero(1, 1);
  sets.push_back(&zero);
  return with_margins({range_of(sets, 0)}, 0)[0];
}

void draw_map(Canvas& canvas, const View& view, const FieldPicture& picture, double most) {
  Eigen::MatrixXd table(std::ssize(picture.times), picture.axes[0].size());
  for (Eigen::Index k = 0; k < table.rows(); ++k) table.row(k) = picture.velocities[static_cast<std::size_t>(k)];
  const auto colour_of = [](double part) { return signed_colour(0.5 + part / 2); };
  canvas.raster(coloured(table, pixel_places(picture.times, kMapColumns), pixel_places(picture.axes[0], kMapRows, true),
                         most, colour_of),
                view.box);
  std::vector<int> landmarks(static_cast<std::size_t>(picture.start.count()));
  for (std::size_t a = 0; a < landmarks.size(); ++a) landmarks[a] = static_cast<int>(a);
  const auto kept = thin_paths(picture.positions, landmarks, picture.times,
                               std::max<std::size_t>(4, kFieldPathVertices / landmarks.size()));
  std::vector<Points> paths;
  for (std::size_t a = 0; a < landmarks.size(); ++a)
    paths.push_back(view.pixels(values_over_time(picture.positions, picture.times, landmarks[a], 0, kept[a])));
  canvas.look_through(view.box);
  canvas.lines(std::move(paths), kFieldPath);
  canvas.look_through({});
}

void draw_zero(Canvas& canvas, const View& view) {
  canvas.lines({view.pixels(line(0, view.y.low, 0, view.y.high))}, {colour::kReference, 1.2});
}

/// Values to the right, space upwards.
void draw_velocity(Canvas& canvas, const View& view, const FieldPicture& picture, std::size_t k) {
  Points curve(2, picture.axes[0].size());
  curve << picture.velocities[k], picture.axes[0].transpose();
  draw_zero(canvas, view);
  canvas.lines({view.pixels(curve)}, {colour::kResult, 1.8});
  draw_frame(canvas, view, fmt::format("u at t = {:.4g}", picture.times[k]), false);
}

void draw_momenta(Canvas& canvas, const View& view, const FieldPicture& picture, std::size_t k) {
  Points feet(2, picture.start.count()), heads = feet;
  feet << Points::Zero(1, feet.cols()), picture.positions[k];
  heads << picture.momenta[k], picture.positions[k];
  draw_zero(canvas, view);
  canvas.segments(view.pixels(feet), view.pixels(heads), kStem);
  canvas.dots(view.pixels(heads), 3.6, colour::kMomentum);
  draw_frame(canvas, view, fmt::format("Momenta p at t = {:.4g}", picture.times[k]), false);
}

Canvas compose_line(const FieldPicture& picture, std::size_t k) {
  const Interval space = interval_of(picture.axes[0]);
  const double left = kEdge + left_number_width(space, kFieldHeight), bottom = kLegendRoom + kTicRoom;
  Canvas canvas = titled_canvas({picture.title, picture.subtitle}, left, kWidth, bottom + kFieldHeight + kHeading);
  const double map_width = kWidth - left - kEdge - 2 * (kSideWidth + kSideGap);
  View view{{left, bottom, map_width, kFieldHeight}, {picture.times.front(), picture.times.back()}, space};
  const double most = largest_norm(picture.velocities);
  draw_map(canvas, view, picture, most);
  if (k + 1 < picture.times.size())
    canvas.lines({view.pixels(line(picture.times[k], space.low, picture.times[k], space.high))}, {colour::kResult, 2});
  draw_frame(canvas, view, "Velocity u over time t → and space x ↑", true);

  const auto beside = [&](const std::vector<Points>& values) {
    view.box = {view.box.right() + kSideGap, bottom, kSideWidth, kFieldHeight};
    view.x = range_with_zero(values);
    return view;
  };
  draw_velocity(canvas, beside(picture.velocities), picture, k);
  draw_momenta(canvas, beside(picture.momenta), picture, k);
  draw_legend(canvas, {bar_entry(fmt::format("u = −{:.3g}", most), fmt::format("{:.3g}", most), signed_colour),
                       line_entry("landmarks", kFieldPath.colour), line_entry("momenta", kStem.colour)});
  return canvas;
}

// ---- in the plane

/// One component of the velocities, or their norms, as a table: x down its rows, y along them.
Eigen::MatrixXd table_of(const FieldPicture& picture, const Eigen::RowVectorXd& values) {
  return values.reshaped<Eigen::RowMajor>(picture.axes[0].size(), picture.axes[1].size());
}

void draw_speed(Canvas& canvas, const View& view, const FieldPicture& picture, std::size_t k, double most) {
  const double pixel = std::max(view.x.span(), view.y.span()) / kPlanePixels;
  const auto count = [&](const Interval& range) {
    return std::max(2, static_cast<int>(std::lround(range.span() / pixel)));
  };
  const Interval x = interval_of(picture.axes[0]), y = interval_of(picture.axes[1]);
  const Points corners = view.pixels((Points(2, 2) << x.low, x.high, y.low, y.high).finished());
  const Box box{corners(0, 0), corners.row(1).minCoeff(), corners(0, 1) - corners(0, 0),
                std::abs(corners(1, 1) - corners(1, 0))};
  canvas.raster(
      coloured(table_of(picture, picture.velocities[k].colwise().norm()), pixel_places(picture.axes[0], count(x)),
               pixel_places(picture.axes[1], count(y), !view.y_down), most, speed_colour),
      box);
}

void draw_arrows(Canvas& canvas, const View& view, const FieldPicture& picture, std::size_t k, double most) {
  const Eigen::MatrixXd u = table_of(picture, picture.velocities[k].row(0));
  const Eigen::MatrixXd v = table_of(picture, picture.velocities[k].row(1));
  const double distance = std::max(interval_of(picture.axes[0]).span(), interval_of(picture.axes[1]).span()) / kArrows;
  const auto count = [&](const Eigen::VectorXd& axis) {
    return std::max(1, static_cast<int>(std::lround(interval_of(axis).span() / distance)));
  };
  std::vector<Eigen::Vector2d> from, to;
  const auto value = [](const Eigen::VectorXd& axis, double place) { return axis[0] + place * (axis[1] - axis[0]); };
  for (const double i : pixel_places(picture.axes[0], count(picture.axes[0])))
    for (const double j : pixel_places(picture.axes[1], count(picture.axes[1]))) {
      const Eigen::Vector2d velocity(bilinear(u, i, j), bilinear(v, i, j));
      if (velocity.norm() < kLeastArrow * most) continue;
      const Eigen::Vector2d half = 0.5 * distance / most * velocity;
      const Eigen::Vector2d middle(value(picture.axes[0], i), value(picture.axes[1], j));
      from.emplace_back(middle - half);
      to.emplace_back(middle + half);
    }
  Points tails(2, std::ssize(from)), tips(2, std::ssize(to));
  for (std::size_t i = 0; i < from.size(); ++i) {
    tails.col(static_cast<Eigen::Index>(i)) = from[i];
    tips.col(static_cast<Eigen::Index>(i)) = to[i];
  }
  canvas.arrows(view.pixels(tails), view.pixels(tips), kFieldArrow);
}

Canvas compose_plane(const FieldPicture& picture, const std::vector<std::size_t>& shown) {
  const View view{.box = {},
                  .x = interval_of(picture.axes[0]),
                  .y = interval_of(picture.axes[1]),
                  .y_down = picture.start.frame.y_down};
  Plan plan = arrange({picture.title, picture.subtitle}, std::vector<View>(shown.size(), view),
                      {.tallest = 800, .least_width = 960});
  const double most = largest_norm(picture.velocities);
  const Figure figure = plan_figure(picture.start, scale_of(plan.views.front()));
  for (std::size_t i = 0; i < shown.size(); ++i) {
    draw_speed(plan.canvas, plan.views[i], picture, shown[i], most);
    draw_arrows(plan.canvas, plan.views[i], picture, shown[i], most);
    draw_shape(plan.canvas, plan.views[i].pixels(picture.positions[shown[i]]), figure, colour::kSource);
    draw_frame(plan.canvas, plan.views[i], fmt::format("t = {:.4g}", picture.times[shown[i]]), i == 0);
  }
  std::vector<LegendEntry> legend = legend_of_shape(figure, colour::kSource, "landmarks");
  legend.push_back(bar_entry("|u| = 0", fmt::format("{:.3g}", most), speed_colour));
  legend.push_back(arrow_entry("u", kFieldArrow.colour));
  draw_legend(plan.canvas, legend);
  return std::move(plan.canvas);
}

void check(const FieldPicture& picture) {
  const Checks checks("field picture");
  checks.shape(picture.start, "the start");
  const auto d = static_cast<std::size_t>(picture.start.dimension());
  if (d > 2) checks.refuse("the start is in 3D");
  checks.times(picture.times, picture.positions.size(), "the positions");
  checks.times(picture.times, picture.velocities.size(), "the velocities");
  checks.trajectory(picture.positions, picture.start, "the start", "positions");
  checks.trajectory(picture.momenta, picture.start, "the start", "momenta");
  if (picture.momenta.size() != picture.times.size()) checks.refuse("there are other times of momenta");
  if (picture.axes.size() != d) checks.refuse(fmt::format("{} axes in {}D", picture.axes.size(), d));
  Eigen::Index count = 1;
  for (const Eigen::VectorXd& axis : picture.axes) {
    if (axis.size() < 2) checks.refuse("an axis has less than 2 points");
    count *= axis.size();
  }
  for (const Points& velocity : picture.velocities) {
    checks.points(velocity, picture.start.dimension(), "a velocity");
    if (velocity.cols() != count) checks.refuse(fmt::format("{} velocities at {} points", velocity.cols(), count));
  }
}

}  // namespace

void write_field_picture(const FieldPicture& picture, const PictureFiles& files) {
  check(picture);
  const std::size_t last = picture.times.size() - 1;
  const bool is_line = picture.start.dimension() == 1;
  (is_line ? compose_line(picture, last) : compose_plane(picture, {0, last / 2, last})).write(files);
}

std::string field_frame_png(const FieldPicture& picture, std::size_t k, const PictureFiles& look) {
  check(picture);
  const bool is_line = picture.start.dimension() == 1;
  return (is_line ? compose_line(picture, k) : compose_plane(picture, {k})).png(look.width, look.dpi);
}

}  // namespace pulson::draw
