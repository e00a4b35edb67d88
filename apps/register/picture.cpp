#include "picture.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "grid.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson {
namespace {

constexpr int kCells = 22;         // of the grid, along the larger side
constexpr int kPointsPerCell = 6;  // so that a bent line is smooth

std::vector<Points> material_paths(const MaterialFlow& flow, const std::vector<double>& times, double low,
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

std::string subtitle(const Registration& registration) {
  std::string text = registration.noise == "none" ? std::string("no noise") : registration.noise;
  text += fmt::format("  ·  {}  ·  rms {:.3g}, before {:.3g}  ·  energy {:.3g}",
                      registration_system(registration).kernel.spec(3), registration.rms(), registration.initial_rms(),
                      registration.cost.energy);
  if (registration.increments.size() > 0 && registration.cost.action > 0)
    text += fmt::format(" + action {:.3g}", registration.cost.action);
  if (!registration.converged) text += "  ·  not converged";
  if (!registration.matched()) text += "  ·  not matched";
  return text;
}

void add_material(const Registration& registration, const Trajectory& path, RegistrationPicture& picture) {
  const MaterialFlow flow(registration_system(registration), path);
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
  const bool tells = shape.name.find_first_not_of("0123456789") != std::string::npos;
  return tells ? shape.name : std::filesystem::path(shape.source).filename().string();
}

RegistrationPicture make_registration_picture(const Registration& registration, const Trajectory& path) {
  RegistrationPicture picture;
  picture.source = registration.source;
  picture.aligned = registration.alignment.kind != AlignmentKind::kNone;
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
