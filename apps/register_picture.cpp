#include "register_picture.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "pulson/warp/material_flow.hpp"

namespace pulson {
namespace {

constexpr double kMargin = 0.12;    // of the larger side of the box, around all that is drawn
constexpr int kCells = 22;          // of the grid, along the larger side
constexpr int kPointsPerCell = 6;   // so that a bent line is smooth
constexpr int kMaterialPaths = 41;  // of a line's material points

std::pair<Eigen::VectorXd, Eigen::VectorXd> drawn_box(const Registration& registration) {
  const Eigen::Index n = registration.result.cols(), m = registration.target.points.cols();
  Points all(registration.result.rows(), 2 * n + m);
  all << registration.source.points, registration.target.points, registration.result;
  const auto [low, high] = bounding_box(all);  // of the points that miss no coordinate
  const double side = std::max((high - low).maxCoeff(), 1e-300);
  return {low.array() - kMargin * side, high.array() + kMargin * side};
}

// Points at `count` equal distances from `low` to `high`.
Eigen::VectorXd even(double low, double high, int count) { return Eigen::VectorXd::LinSpaced(count, low, high); }

// Lines of a square grid over a box, each 2×M.
std::vector<Points> grid_lines(const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  const double cell = (high - low).maxCoeff() / kCells;
  std::vector<Points> lines;
  for (int axis = 0; axis < 2; ++axis) {
    const int along = 1 - axis;
    const int count = static_cast<int>(std::lround((high[axis] - low[axis]) / cell)) + 1;
    const int samples = static_cast<int>(std::lround((high[along] - low[along]) / cell)) * kPointsPerCell + 1;
    for (const double place : even(low[axis], high[axis], std::max(count, 2))) {
      Points line(2, std::max(samples, 2));
      line.row(axis).setConstant(place);
      line.row(along) = even(low[along], high[along], static_cast<int>(line.cols())).transpose();
      lines.push_back(line);
    }
  }
  return lines;
}

std::vector<Points> carry(const MaterialFlow& flow, const std::vector<Points>& lines) {
  Eigen::Index count = 0;
  for (const Points& line : lines) count += line.cols();
  Points labels(2, count);
  Eigen::Index column = 0;
  for (const Points& line : lines) {
    labels.middleCols(column, line.cols()) = line;
    column += line.cols();
  }
  const Points end = flow.end(labels);
  std::vector<Points> carried;
  column = 0;
  for (const Points& line : lines) {
    carried.emplace_back(end.middleCols(column, line.cols()));
    column += line.cols();
  }
  return carried;
}

std::vector<Points> material_paths(const MaterialFlow& flow, const std::vector<double>& times, double low,
                                   double high) {
  const std::vector<Points> places = flow.paths(even(low, high, kMaterialPaths).transpose());
  std::vector<Points> paths;
  for (Eigen::Index m = 0; m < kMaterialPaths; ++m) {
    Points path(2, static_cast<Eigen::Index>(places.size()));
    for (std::size_t k = 0; k < places.size(); ++k) path.col(static_cast<Eigen::Index>(k)) << times[k], places[k](0, m);
    paths.push_back(path);
  }
  return paths;
}

std::string subtitle(const Registration& registration) {
  std::string text = registration.noise == "none" ? std::string("no noise") : registration.noise;
  text += fmt::format("  ·  {}  ·  rms {:.3g} (was {:.3g})  ·  energy {:.3g}",
                      registration_system(registration).kernel.spec(3), registration.rms(), registration.initial_rms(),
                      registration.cost.energy);
  if (registration.mode == MatchingMode::kMap) text += fmt::format(" + action {:.3g}", registration.cost.action);
  if (!registration.converged) text += "  ·  not converged";
  if (!registration.matched()) text += "  ·  not matched";
  return text;
}

// Its name; where that is a mere number, the file's name and the number.
std::string short_name(const Landmarks& shape) {
  const bool tells = shape.name.find_first_not_of("0123456789") != std::string::npos;
  return tells ? shape.name : std::filesystem::path(shape.source).filename().string();
}

void add_material(const Registration& registration, const Trajectory& path, RegistrationPicture& picture) {
  const MaterialFlow flow(registration_system(registration), path);
  const auto [low, high] = drawn_box(registration);
  if (registration.source.dimension() == 2) {
    const std::vector<Points> lines = grid_lines(low, high);
    picture.grid_after = carry(flow, lines);
    picture.grid_before = lines;
  } else {
    picture.grid_paths = material_paths(flow, picture.times, low[0], high[0]);
  }
}

}  // namespace

RegistrationPicture make_registration_picture(const Registration& registration, const Trajectory& path) {
  RegistrationPicture picture;
  picture.source = registration.source;
  picture.target = registration.target;
  picture.corresponds = registration.data.kind == DataKind::kLandmarks;
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

}  // namespace pulson
