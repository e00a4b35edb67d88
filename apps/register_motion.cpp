#include "register_motion.hpp"

#include <algorithm>
#include <cmath>

#include "pulson/warp/material_flow.hpp"
#include "register_grid.hpp"

namespace pulson {
namespace {

constexpr int kMostFrames = 41;
constexpr int kFewestFrames = 5;
constexpr int kNumbers = 160'000;  // of the landmarks' places: about a megabyte of the page
constexpr int kManyLandmarks = 300;
constexpr int kMostWithGrid = 2000;  // landmarks: with more, the grid would cost a good part of the match
constexpr double kLargest = 1e150;   // a length whose square is a number

// The steps that are shown: the first and the last and, evenly, no more than `most` in all.
std::vector<int> shown_steps(int steps, int most) {
  const int stride = std::max(1, (steps + most - 2) / (most - 1));
  std::vector<int> shown;
  for (int k = 0; k < steps; k += stride) shown.push_back(k);
  shown.push_back(steps);
  return shown;
}

std::vector<Points> chosen(const std::vector<Points>& all, const std::vector<int>& steps) {
  std::vector<Points> some;
  for (const int k : steps) some.push_back(all[static_cast<std::size_t>(k)]);
  return some;
}

// Landmarks may have a path where the plane between them has none: then there is no grid.
void add_material(const Registration& registration, const Trajectory& path, const std::vector<int>& steps,
                  ReportMotion& motion) {
  const auto [low, high] = drawn_box(registration);
  Points labels;
  if (registration.source.dimension() == 1) {
    motion.lines.assign(kMaterialPaths, 1);
    labels = Eigen::VectorXd::LinSpaced(kMaterialPaths, low[0], high[0]).transpose();
  } else {
    const bool many = registration.source.count() > kManyLandmarks;
    const std::vector<Points> lines = grid_lines(low, high, many ? 14 : 20, many || steps.size() > 24 ? 2 : 3);
    for (const Points& line : lines) motion.lines.push_back(static_cast<int>(line.cols()));
    labels = joined_lines(lines);
  }
  try {
    motion.grid = chosen(MaterialFlow(registration_system(registration), path).paths(labels), steps);
  } catch (const StepError&) {
    motion.lines.clear();
  }
}

bool can_be_drawn(const std::vector<Points>& frames) {
  return std::all_of(frames.begin(), frames.end(),
                     [](const Points& frame) { return (frame.array().abs() < kLargest).all(); });
}

std::string caption(const ReportMotion& motion) {
  const std::string way = "The landmarks moving from the source to their end points, with the target as rings. ";
  switch (motion.source.dimension()) {
    case 1:
      return way + "Time runs to the right; thin lines are points between the landmarks that move with them.";
    case 2:
      return way + (motion.grid.empty()
                        ? "No grid is drawn."
                        : "The grid moves with the landmarks; noise that separates neighbours may fold it.");
    default:
      return way + "Drag sideways or up and down, or use the arrow keys, to turn the view.";
  }
}

}  // namespace

std::optional<ReportMotion> registration_motion(const Registration& registration, const Trajectory& path,
                                                const std::vector<int>& outliers) {
  const int numbers = registration.source.count() * registration.source.dimension();
  const std::vector<int> steps =
      shown_steps(path.grid.steps, std::clamp(kNumbers / std::max(numbers, 1), kFewestFrames, kMostFrames));
  ReportMotion motion;
  motion.source = registration.source;
  motion.target = registration.target;
  motion.corresponds = registration.data.kind == DataKind::kLandmarks;
  motion.outliers = outliers;
  for (const int k : steps) {
    motion.times.push_back(path.grid.at(k));
    motion.frames.push_back(path.states[static_cast<std::size_t>(k)].q);
  }
  const Points& target = motion.target.points;
  if (!can_be_drawn(motion.frames) || (target.array().abs() >= kLargest).any()) return std::nullopt;
  if (registration.source.dimension() < 3 && registration.source.count() <= kMostWithGrid)
    add_material(registration, path, steps, motion);
  if (!can_be_drawn(motion.grid)) {
    motion.grid.clear();
    motion.lines.clear();
  }
  motion.caption = caption(motion);
  return motion;
}

}  // namespace pulson
