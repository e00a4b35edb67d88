#include "surface.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/warp/material_flow.hpp"
#include "shell/path_options.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr int kStillVertices = 20000, kPageVertices = 2500;
constexpr int kManyLandmarks = 1000,
              kFewVertices = 2000;  // with so many, so few, or they would cost more than the match
constexpr double kElsewhere = 0.2;  // of the diameter

std::optional<fs::path> surface_beside(const Landmarks& source) {
  const fs::path file = source.source.substr(0, source.source.find('#'));
  for (const char* extension : {".ply", ".stl", ".obj"}) {
    const fs::path surface = file.parent_path() / (formats::file_stem(file) + extension);
    if (!is_file(surface)) continue;
    run_paths().reads(surface, "the surface of " + source.source);
    return surface;
  }
  return std::nullopt;
}

// The median over the landmarks of the distance to the nearest vertex.
double distance_of_landmarks(const Points& landmarks, const Points& vertices) {
  std::vector<double> distances;
  for (const auto landmark : landmarks.colwise())
    distances.push_back((vertices.colwise() - landmark).colwise().norm().minCoeff());
  const auto middle = distances.begin() + std::ssize(distances) / 2;
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

std::optional<formats::Surface> surface_of(const Landmarks& source, const std::string& file,
                                           std::vector<std::string>& notes) {
  if (!file.empty() && source.dimension() != 3)
    throw InputError(fmt::format("--mesh needs landmarks in 3D; {} is in {}D", source.source, source.dimension()));
  const std::optional<fs::path> path = !file.empty()             ? std::optional<fs::path>(file)
                                       : source.dimension() == 3 ? surface_beside(source)
                                                                 : std::nullopt;
  if (!path) return std::nullopt;
  try {
    formats::Surface surface = formats::read_surface(*path);
    if (surface.vertices.axes.empty()) surface.vertices.axes = source.axes;
    surface.vertices.units = source.units;
    return formats::coarsened(surface, source.count() > kManyLandmarks ? kFewVertices : kStillVertices);
  } catch (const InputError& error) {
    if (!file.empty()) throw;
    notes.push_back(fmt::format("{}; it is not drawn below the landmarks", error.what()));
    return std::nullopt;
  }
}

void add_surface(const std::optional<formats::Surface>& surface, const matching::Registration& registration,
                 const Trajectory& path, draw::RegistrationPicture& picture, std::vector<std::string>& notes) {
  if (!surface) return;
  const Landmarks placed = in_frame_of(registration.target, surface->vertices, notes);
  const Points vertices =
      registration.alignment.kind == AlignmentKind::kNone ? placed.points : registration.alignment.apply(placed.points);
  const Points& source = registration.source.points;
  if (distance_of_landmarks(source, vertices) > kElsewhere * diameter(source)) {
    notes.push_back(
        fmt::format("{}: it lies elsewhere than the landmarks, perhaps in other axes or units, and is not drawn",
                    surface->vertices.source));
    return;
  }
  try {
    picture.surface_after = warp::MaterialFlow(registration_system(registration), path).end(vertices);
  } catch (const StepError&) {
    return;
  }
  picture.surface_before = vertices;
  picture.triangles = surface->triangles;
}

void add_surface(const draw::RegistrationPicture& picture, const matching::Registration& registration,
                 const Trajectory& path, html::ReportMotion& motion) {
  if (picture.triangles.empty()) return;
  constexpr int kTimes = 8;
  formats::Surface surface;
  surface.vertices.points = picture.surface_before;
  surface.triangles = picture.triangles;
  surface = formats::coarsened(surface, kPageVertices);
  const std::vector<Points> places =
      warp::MaterialFlow(registration_system(registration), path).paths(surface.vertices.points);
  const int last = path.grid.steps, times = std::min(kTimes, last);
  for (int i = 0; i <= times; ++i) {
    const int step = i * last / times;
    motion.surface_times.push_back(path.grid.at(step));
    motion.surface.push_back(places[static_cast<std::size_t>(step)]);
  }
  motion.triangles = surface.triangles;
  if (can_be_drawn(motion.surface)) return;
  motion.triangles.clear();
  motion.surface.clear();
  motion.surface_times.clear();
}

}  // namespace pulson
