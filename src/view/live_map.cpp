#include "live_map.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/matching/near_registration.hpp"
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

std::vector<int> common_landmarks(const Points& source, const Points& target, const LiveMapOptions& options) {
  if (options.columns < 2 || options.rows < 2 || options.columns * options.rows > kMostNodes || options.frames < 1)
    throw InputError("the grid of the map is too coarse or too fine");
  std::vector<int> landmarks;
  for (int a = 0; a < source.cols(); ++a)
    if (source.col(a).allFinite() && target.col(a).allFinite()) landmarks.push_back(a);
  if (landmarks.size() < 3)
    throw InputError(fmt::format("{} of the landmarks are on both pictures; a match needs 3", landmarks.size()));
  return landmarks;
}

// Of the grid as it lies over the grid as it was, by differences between neighbours.
Eigen::VectorXd jacobians_of_grid(const Points& before, const Points& after, const LiveMapOptions& options) {
  const auto area = [&](const Points& nodes, int c, int r) {
    const auto at = [&](int column, int row) {
      return nodes.col(std::clamp(row, 0, options.rows - 1) * options.columns +
                       std::clamp(column, 0, options.columns - 1));
    };
    const Eigen::Vector2d x = at(c + 1, r) - at(c - 1, r), y = at(c, r + 1) - at(c, r - 1);
    return x.x() * y.y() - x.y() * y.x();
  };
  Eigen::VectorXd jacobians(before.cols());
  for (int r = 0, k = 0; r < options.rows; ++r)
    for (int c = 0; c < options.columns; ++c, ++k) jacobians[k] = area(after, c, r) / area(before, c, r);
  return jacobians;
}

double folded_fraction(const Eigen::VectorXd& jacobians) {
  return static_cast<double>((jacobians.array() < 0).count()) / static_cast<double>(jacobians.size());
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

namespace {

// What all matches show: frames and paths over time, residuals and the part of the noise.
LiveMap shown_match(const matching::Registration& registration, std::vector<int> landmarks, const std::string& noise,
                    const warp::MaterialFlow& flow, const std::vector<Points>& all, int frames) {
  LiveMap map;
  map.landmarks = std::move(landmarks);
  const std::size_t steps = all.size() - 1;
  for (const std::size_t step : shown_steps(steps, frames)) {
    map.times.push_back(static_cast<double>(step) / static_cast<double>(steps));
    map.frames.push_back(all[step]);
    map.paths.push_back(flow.path().states[step].q);
  }
  map.residuals = registration.distances();
  for (const int k : registration.unmatched_landmarks())
    map.unmatched.push_back(map.landmarks[static_cast<std::size_t>(k)]);
  if (registration.noise != "none") map.noise_share = shares_of_noise(registration);
  map.kernel = registration.kernel;
  map.rms = registration.rms();
  map.converged = registration.converged;
  map.ridge = registration.sigma * registration.sigma * registration.lambda;
  map.near = {map.landmarks, noise, registration.kernel, registration.lambda, {}};
  // Of landmarks at one place one alone takes part: such a match is not followed.
  if (registration.source.count() == std::ssize(map.landmarks))
    for (const PhaseState& state : flow.path().states) map.near.path.push_back(state.q);
  return map;
}

}  // namespace

LiveMap live_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                 const std::function<bool()>& is_unwanted) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<int> landmarks = common_landmarks(source, target, options);
  matching::RegistrationOptions match;
  match.noise = options.noise;
  match.minimise.interrupted = is_unwanted;
  const matching::Registration registration = matching::register_shapes(
      placed_landmarks(source, landmarks, "left"), placed_landmarks(target, landmarks, "right"), match);
  if (match.minimise.is_interrupted()) throw Superseded();
  const warp::MaterialFlow flow(matching::registration_system(registration), matching::replay(registration));
  const Points nodes = registration.alignment.apply(grid_over(width, height, options));
  LiveMap map = shown_match(registration, landmarks, options.noise, flow, flow.paths(nodes), options.frames);
  const warp::MovedPoints ends = flow.end_with_gradients(nodes);
  map.jacobians = ends.jacobians();
  map.folded_fraction = ends.folded_fraction();
  map.seconds = seconds_since(begin);
  return map;
}

bool can_follow(const NearMatch& near, const Points& source, const Points& target, const LiveMapOptions& options) {
  return near.path.size() > 1 && near.noise == options.noise &&
         near.landmarks == common_landmarks(source, target, options);
}

LiveMap followed_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                     const NearMatch& near) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<int> landmarks = common_landmarks(source, target, options);
  matching::RegistrationOptions match;
  match.noise = options.noise;
  match.kernel = near.kernel;
  match.lambda = near.lambda;
  const matching::Registration registration = matching::register_near(
      placed_landmarks(source, landmarks, "left"), placed_landmarks(target, landmarks, "right"), match, near.path);
  const warp::MaterialFlow flow(matching::registration_system(registration), matching::replay(registration));
  const Points nodes = registration.alignment.apply(grid_over(width, height, options));
  LiveMap map = shown_match(registration, landmarks, options.noise, flow, flow.paths(nodes), options.frames);
  map.jacobians = jacobians_of_grid(map.frames.front(), map.frames.back(), options);
  map.folded_fraction = folded_fraction(map.jacobians);
  map.is_followed = true;
  map.seconds = seconds_since(begin);
  return map;
}

LiveMap linear_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                   const std::string& kernel, double ridge) {
  const auto begin = std::chrono::steady_clock::now();
  LiveMap map;
  map.landmarks = common_landmarks(source, target, options);
  if (!(ridge >= 0 && std::isfinite(ridge))) throw InputError("'ridge' is no number");
  const Points from = source(Eigen::all, map.landmarks), to = target(Eigen::all, map.landmarks);
  const Alignment alignment = align(from, to, AlignmentKind::kSimilarity);
  const Points q0 = alignment.apply(from), nodes = alignment.apply(grid_over(width, height, options));
  const KernelOperator operator_of = make_kernel(kernel);
  Eigen::MatrixXd gram = operator_of.gram(q0, q0);
  gram.diagonal().array() += ridge + 1e-10 * gram(0, 0);  // landmarks at one place, but for rounding
  const Points coefficients = gram.ldlt().solve((to - q0).transpose()).transpose();
  map.times = {0, 1};
  map.frames = {nodes, nodes + coefficients * operator_of.gram(q0, nodes)};
  map.paths = {q0, q0 + coefficients * operator_of.gram(q0, q0)};
  map.jacobians = jacobians_of_grid(map.frames[0], map.frames[1], options);
  map.folded_fraction = folded_fraction(map.jacobians);
  map.residuals = (map.paths[1] - to).colwise().norm();
  map.rms = std::sqrt(map.residuals.squaredNorm() / static_cast<double>(map.residuals.size()));
  map.kernel = kernel;
  map.ridge = ridge;
  map.is_linear = map.converged = true;
  map.seconds = seconds_since(begin);
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
                      {"ridge", map.ridge},
                      {"linear", map.is_linear},
                      {"followed", map.is_followed},
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
