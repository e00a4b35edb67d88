#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "pulson/core/name_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

constexpr double kMargin = 0.12;  // of the larger side of the box

// Points at `count` equal distances from `low` to `high`.
Eigen::VectorXd even(double low, double high, int count) { return Eigen::VectorXd::LinSpaced(count, low, high); }

}  // namespace

std::pair<Eigen::VectorXd, Eigen::VectorXd> drawn_box(const matching::Registration& registration) {
  const Eigen::Index n = registration.result.cols(), m = registration.target.points.cols();
  Points all(registration.result.rows(), 2 * n + m);
  all << registration.source.points, registration.target.points, registration.result;
  const auto [low, high] = bounding_box(all);  // of the points that miss no coordinate
  const double side = std::max((high - low).maxCoeff(), 1e-300);
  return {low.array() - kMargin * side, high.array() + kMargin * side};
}

std::vector<Points> grid_lines(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int cells,
                               int points_per_cell) {
  const double cell = (high - low).maxCoeff() / cells;
  std::vector<Points> lines;
  for (int axis = 0; axis < 2; ++axis) {
    const int along = 1 - axis;
    const int count = static_cast<int>(std::lround((high[axis] - low[axis]) / cell)) + 1;
    const int samples = static_cast<int>(std::lround((high[along] - low[along]) / cell)) * points_per_cell + 1;
    for (const double place : even(low[axis], high[axis], std::max(count, 2))) {
      Points line(2, std::max(samples, 2));
      line.row(axis).setConstant(place);
      line.row(along) = even(low[along], high[along], static_cast<int>(line.cols())).transpose();
      lines.push_back(line);
    }
  }
  return lines;
}

Points joined_lines(const std::vector<Points>& lines) {
  Eigen::Index count = 0;
  for (const Points& line : lines) count += line.cols();
  Points points(2, count);
  Eigen::Index column = 0;
  for (const Points& line : lines) {
    points.middleCols(column, line.cols()) = line;
    column += line.cols();
  }
  return points;
}

std::vector<Points> split_lines(const Points& points, const std::vector<Points>& lines) {
  std::vector<Points> split;
  Eigen::Index column = 0;
  for (const Points& line : lines) {
    split.emplace_back(points.middleCols(column, line.cols()));
    column += line.cols();
  }
  return split;
}

namespace {

constexpr int kCells = 22;         // of the grid, along the larger side
constexpr int kPointsPerCell = 6;  // so that a bent line is smooth

std::vector<Points> material_paths(const warp::MaterialFlow& flow, const std::vector<double>& times, double low,
                                   double high) {
  const std::vector<Points> places = flow.paths(Eigen::VectorXd::LinSpaced(kMaterialPaths, low, high).transpose());
  std::vector<Points> paths;
  for (Eigen::Index m = 0; m < kMaterialPaths; ++m) {
    Points path(2, static_cast<Eigen::Index>(places.size()));
    for (std::size_t k = 0; k < places.size(); ++k) path.col(static_cast<Eigen::Index>(k)) << times[k], places[k](0, m);
    paths.push_back(path);
  }
  return paths;
}

std::string subtitle(const matching::Registration& registration) {
  std::string text = registration.noise == "none" ? std::string("no noise") : shortened_spec(registration.noise);
  text += fmt::format("  ·  {}  ·  rms {:.3g}, before {:.3g}  ·  energy {:.3g}",
                      registration_system(registration).kernel.spec(3), registration.rms(), registration.initial_rms(),
                      registration.cost.energy);
  if (registration.increments.size() > 0 && registration.cost.action > 0)
    text += fmt::format(" + action {:.3g}", registration.cost.action);
  if (!registration.converged) text += "  ·  not converged";
  if (!registration.matched()) text += "  ·  not matched";
  return text;
}

void add_material(const matching::Registration& registration, const Trajectory& path,
                  draw::RegistrationPicture& picture) {
  const warp::MaterialFlow flow(registration_system(registration), path);
  const auto [low, high] = drawn_box(registration);
  if (registration.source.dimension() == 2) {
    const std::vector<Points> lines = grid_lines(low, high, kCells, kPointsPerCell);
    picture.grid_after = split_lines(flow.end(joined_lines(lines)), lines);
    picture.grid_before = lines;
  } else {
    picture.grid_paths = material_paths(flow, picture.times, low[0], high[0]);
  }
}

}  // namespace

std::string short_name(const Landmarks& shape) {
  // "LJSON" is what menpo calls every shape.
  const bool is_descriptive = shape.name.find_first_not_of("0123456789") != std::string::npos && shape.name != "LJSON";
  if (is_descriptive) return shape.name;
  const std::size_t number = std::min(shape.source.rfind('#'), shape.source.size());
  return std::filesystem::path(shape.source.substr(0, number)).stem().string() + shape.source.substr(number);
}

draw::RegistrationPicture make_registration_picture(const matching::Registration& registration,
                                                    const Trajectory& path) {
  draw::RegistrationPicture picture;
  picture.source = registration.source;
  picture.aligned = registration.alignment.kind != AlignmentKind::kNone;
  picture.target = registration.target;
  picture.corresponds = registration.data.kind == matching::DataKind::kLandmarks;
  picture.result = registration.result;
  for (int k = 0; k <= path.grid.steps; ++k) {
    picture.times.push_back(path.grid.at(k));
    picture.trajectory.push_back(path.states[static_cast<std::size_t>(k)].q);
  }
  picture.title = short_name(registration.original) + " → " + short_name(registration.target);
  picture.subtitle = subtitle(registration);

  // Landmarks may have a path where the plane between them has none: the steps are too long for the strain there.
  try {
    if (registration.source.dimension() < 3) add_material(registration, path, picture);
  } catch (const StepError&) {
    picture.subtitle += "  ·  steps too long to draw the grid";
  }
  return picture;
}

void add_verdicts(const records::RegistrationFacts& facts, draw::RegistrationPicture& picture) {
  picture.doubted = facts.verdicts.doubted();
  if (picture.source.dimension() != 2) return;
  if (facts.verdicts.action_share.size() == 0) return;
  picture.action = facts.verdicts.action_share;
  // A landmark may oppose the flow of its neighbours, which lowers the energy.
  picture.energy = facts.shares.energy.cwiseMax(0);
  picture.map_triangles = warp::delaunay_triangles(picture.source.points);
}

namespace {

std::vector<Points> chosen(const std::vector<Points>& all, const std::vector<int>& steps) {
  std::vector<Points> some;
  for (const int k : steps) some.push_back(all[static_cast<std::size_t>(k)]);
  return some;
}

// Where a place is in an image: parts of its width and, from the top, of its height.
Eigen::Vector2d part_of(const PageImage& image, const Eigen::Vector2d& place, bool y_down) {
  const Eigen::Vector2d part = (place - image.low).cwiseQuotient(image.high - image.low);
  return {part.x(), y_down ? part.y() : 1 - part.y()};
}

}  // namespace

void add_material(const StochasticSystem& system, const Trajectory& path, const std::vector<int>& steps,
                  const MaterialBox& box, html::ReportMotion& motion) {
  constexpr int kManyLandmarks = 300;
  constexpr int kMostWithGrid = 2000;  // landmarks: with more, the grid would cost a good part of the match
  const int d = motion.source.dimension();
  if (d > 2 || motion.source.count() > kMostWithGrid) return;
  Points labels;
  if (d == 1) {
    motion.lines.assign(kMaterialPaths, 1);
    labels = Eigen::VectorXd::LinSpaced(kMaterialPaths, box.low[0], box.high[0]).transpose();
  } else {
    const bool many = motion.source.count() > kManyLandmarks;
    const int points_per_cell = many || steps.size() > 24 ? 2 : 3;
    const std::vector<Points> lines = grid_lines(box.low, box.high, many ? 14 : 20, points_per_cell);
    const auto is_first = [&](const Points& line) { return line(0, 0) == line(0, 1); };  // x is constant
    if (box.below) {
      const auto columns = static_cast<int>(std::count_if(lines.begin(), lines.end(), is_first));
      const bool y_down = motion.source.frame.y_down || motion.target.frame.y_down;
      motion.image = {box.below->picture, part_of(*box.below, box.low, y_down), part_of(*box.below, box.high, y_down),
                      columns, points_per_cell};
    }
    for (const Points& line : lines) motion.lines.push_back(static_cast<int>(line.cols()));
    labels = joined_lines(lines);
  }
  try {
    motion.grid = chosen(warp::MaterialFlow(system, path).paths(labels), steps);
  } catch (const StepError&) {
    motion.grid.clear();
  }
  if (!motion.grid.empty() && can_be_drawn(motion.grid)) return;
  motion.grid.clear();
  motion.lines.clear();
  motion.image.reset();
}

namespace {

std::string caption(const html::ReportMotion& motion) {
  const std::string lead = "The landmarks moving from the source to their end points, with the target as rings. ";
  switch (motion.source.dimension()) {
    case 1:
      return lead + "Time runs to the right; thin lines are points between the landmarks that move with them.";
    case 2:
      return lead + (motion.grid.empty()
                         ? "No grid is drawn."
                         : "The grid moves with the landmarks; noise that separates neighbours may fold it.");
    default:
      return lead + "Drag sideways or up and down, or use the arrow keys, to turn the view.";
  }
}

}  // namespace

std::optional<html::ReportMotion> registration_motion(const matching::Registration& registration,
                                                      const Trajectory& path, const std::vector<int>& outliers,
                                                      const std::optional<PageImage>& below) {
  const std::vector<int> steps = shown_frames(path.grid.steps, registration.source.points.size());
  html::ReportMotion motion;
  motion.source = registration.source;
  motion.target = registration.target;
  motion.corresponds = registration.data.kind == matching::DataKind::kLandmarks;
  motion.outliers = outliers;
  for (const int k : steps) {
    motion.times.push_back(path.grid.at(k));
    motion.frames.push_back(path.states[static_cast<std::size_t>(k)].q);
  }
  const Points& target = motion.target.points;
  if (!can_be_drawn(motion.frames) || (target.array().abs() >= 1e150).any()) return std::nullopt;
  const auto [low, high] = drawn_box(registration);
  add_material(registration_system(registration), path, steps, {low, high, below}, motion);
  motion.caption = caption(motion);
  return motion;
}

}  // namespace pulson
