#include "live_map.hpp"

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson::view {
namespace {

using Eigen::Index;

constexpr int kMostNodes = 40'000;

Landmarks placed_landmarks(const Points& points, const std::vector<int>& places, std::string name) {
  Landmarks shape;
  shape.points = points(Eigen::all, places);
  shape.frame.y_down = true;
  shape.source = std::move(name);
  return shape;
}

// Over the picture with its edges, half a pixel beyond the centres of the outer ones.
Points grid_over(int width, int height, const LiveMapOptions& options) {
  Points nodes(2, static_cast<Index>(options.columns) * options.rows);
  for (int r = 0, k = 0; r < options.rows; ++r)
    for (int c = 0; c < options.columns; ++c, ++k)
      nodes.col(k) << static_cast<double>(c) / (options.columns - 1) * width - 0.5,
          static_cast<double>(r) / (options.rows - 1) * height - 0.5;
  return nodes;
}

// The steps of a path that are shown, the first and the last among them.
std::vector<std::size_t> shown_steps(std::size_t steps, int frames) {
  const auto count = std::min(steps, static_cast<std::size_t>(frames));
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i <= count; ++i) shown.push_back(i * steps / count);
  return shown;
}

// |noise_a| over |flow_a| + |noise_a|.
Eigen::VectorXd shares_of_noise(const matching::Registration& registration) {
  const matching::LandmarkShares shares = matching::landmark_shares(registration);
  if (shares.noise.size() == 0) return {};
  const Eigen::VectorXd noise = shares.noise.colwise().norm(), flow = shares.flow.colwise().norm();
  return (noise.array() / (noise + flow).array().max(1e-12)).matrix();
}

}  // namespace

LiveMap live_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options) {
  if (options.columns < 2 || options.rows < 2 || options.columns * options.rows > kMostNodes || options.frames < 1)
    throw InputError("the grid of the map is too coarse or too fine");
  const auto begin = std::chrono::steady_clock::now();
  LiveMap map;
  for (int a = 0; a < source.cols(); ++a)
    if (source.col(a).allFinite() && target.col(a).allFinite()) map.landmarks.push_back(a);
  if (map.landmarks.size() < 3)
    throw InputError(fmt::format("{} of the landmarks are on both pictures; a match needs 3", map.landmarks.size()));
  matching::RegistrationOptions match;
  match.noise = options.noise;
  const matching::Registration registration = matching::register_shapes(
      placed_landmarks(source, map.landmarks, "left"), placed_landmarks(target, map.landmarks, "right"), match);
  const warp::MaterialFlow flow(matching::registration_system(registration), matching::replay(registration));
  const Points nodes = registration.alignment.apply(grid_over(width, height, options));
  const std::vector<Points> all = flow.paths(nodes);
  const std::size_t steps = all.size() - 1;
  for (const std::size_t step : shown_steps(steps, options.frames)) {
    map.times.push_back(static_cast<double>(step) / static_cast<double>(steps));
    map.frames.push_back(all[step]);
    map.paths.push_back(flow.path().states[step].q);
  }
  const warp::MovedPoints ends = flow.end_with_gradients(nodes);
  map.jacobians = ends.jacobians();
  map.folded_fraction = ends.folded_fraction();
  map.residuals = registration.distances();
  for (const int k : registration.unmatched_landmarks())
    map.unmatched.push_back(map.landmarks[static_cast<std::size_t>(k)]);
  if (registration.noise != "none") map.noise_share = shares_of_noise(registration);
  map.kernel = registration.kernel;
  map.rms = registration.rms();
  map.converged = registration.converged;
  map.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return map;
}

std::string bytes_of(const LiveMap& map, const LiveMapOptions& options) {
  static_assert(std::endian::native == std::endian::little);
  nlohmann::json head{{"columns", options.columns},
                      {"rows", options.rows},
                      {"times", map.times},
                      {"landmarks", map.landmarks},
                      {"residuals", std::vector<double>(map.residuals.begin(), map.residuals.end())},
                      {"unmatched", map.unmatched},
                      {"noise_share", std::vector<double>(map.noise_share.begin(), map.noise_share.end())},
                      {"kernel", map.kernel},
                      {"rms", map.rms},
                      {"folded_fraction", map.folded_fraction},
                      {"converged", map.converged},
                      {"seconds", map.seconds}};
  std::string text = head.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto length = static_cast<std::uint32_t>(text.size());
  std::string bytes(4, '\0');
  std::memcpy(bytes.data(), &length, 4);
  bytes += text;
  const auto append = [&](const auto& numbers) {
    const Eigen::MatrixXf floats = numbers.template cast<float>();
    bytes.append(reinterpret_cast<const char*>(floats.data()), static_cast<std::size_t>(floats.size()) * sizeof(float));
  };
  for (const Points& frame : map.frames) append(frame);
  for (const Points& places : map.paths) append(places);
  append(map.jacobians);
  return bytes;
}

}  // namespace pulson::view
