#include "pulson/fokker_planck/pair_equation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/core.h>

#include "backward_equation.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::fokker_planck {

namespace {

void check(const FreePulson& pulson) {
  require_finite("the free pulson's position", pulson.q);
  require_finite("the free pulson's momentum", pulson.p);
  require_positive("the free pulson's beta", pulson.beta);
  require_positive("the free pulson's K(0)", pulson.at_zero);
}

}  // namespace

double NormalLaw::density(double x) const {
  const double z = x - mean;
  return std::exp(-z * z / (2 * variance)) / std::sqrt(2 * std::numbers::pi * variance);
}

// The complementary error function keeps the digits of the lower tail.
double NormalLaw::cdf(double x) const { return 0.5 * std::erfc((mean - x) / std::sqrt(2 * variance)); }

NormalLaw position_law(const FreePulson& pulson, double time) {
  check(pulson);
  require_positive("the time", time);
  return {pulson.q + pulson.at_zero * pulson.p * time, pulson.beta * pulson.beta * time};
}

NormalLaw position_law_of_scheme(const FreePulson& pulson, const TimeGrid& grid) {
  NormalLaw law = position_law(pulson, grid.time);
  require_positive("the number of steps", grid.steps);
  law.variance = pulson.beta * pulson.beta * (grid.time - 0.75 * grid.dt());
  return law;
}

std::array<NormalLaw, 2> pair_marginals(const FreePulson& first, const FreePulson& second, double time) {
  return {position_law(first, time), position_law(second, time)};
}

NormalLaw gap_law(const FreePulson& first, const FreePulson& second, double time) {
  const auto [law1, law2] = pair_marginals(first, second, time);
  return {law2.mean - law1.mean, law1.variance + law2.variance};
}

namespace {

constexpr int kLeastGrids = 2;
constexpr int kUsualGrids = 3;  // two changes, which show an order
constexpr int kMostGrids = 8;

// Node values times steps of the largest grid that is still solved: about ten minutes.
constexpr double kMostWork = 3e11;

void check(const PairEquationOptions& options) {
  require_positive("the tolerance of the pair equation", options.tolerance);
  if (options.most_grids < kLeastGrids || options.most_grids > kMostGrids)
    throw InputError(fmt::format("the most grids of the pair equation are {}; it must be {} to {}", options.most_grids,
                                 kLeastGrids, kMostGrids));
}

// u at the start and after each step, as it comes: it may leave [0, 1] by the error.
std::vector<double> solve(const ScaledPair& pair, const PairMesh& mesh) {
  BackwardEquation equation(pair, mesh);
  std::vector<double> curve{0};
  for (int step = 1; step <= mesh.steps; ++step) {
    equation.step();
    curve.push_back(equation.at_start());
  }
  return curve;
}

void state_error(PairCrossing& crossing, double tolerance) {
  const std::size_t count = crossing.grids.size();
  const double change = std::abs(crossing.grids[count - 1] - crossing.grids[count - 2]);
  crossing.error = change;
  crossing.order = 0;
  if (count >= kUsualGrids) {
    const double before = crossing.grids[count - 2] - crossing.grids[count - 3];
    const bool shrinks = change <= std::abs(before) / 2;
    const bool same_sign = before * (crossing.grids[count - 1] - crossing.grids[count - 2]) > 0;
    if (!shrinks) crossing.error = std::max(change, std::abs(before));
    if (same_sign) crossing.order = std::max(0.0, std::log2(std::abs(before) / change));
  }
  // A number between 0 and 1 that each step rounds.
  const double rounding = crossing.steps * std::numeric_limits<double>::epsilon();
  crossing.converged = crossing.error <= std::max(tolerance * crossing.grids.back(), rounding);
}

void add_grid(PairCrossing& crossing, const PairMesh& mesh, std::vector<double> fine_curve) {
  const auto between = static_cast<std::size_t>(mesh.steps / kCurveIntervals);
  std::vector<double> curve;
  for (std::size_t step = 0; step < fine_curve.size(); step += between) curve.push_back(fine_curve[step]);
  crossing.fine_curve = std::move(fine_curve);
  crossing.grids.push_back(curve.back());
  crossing.curve_error = 0;
  for (std::size_t k = 0; k < crossing.curve.size(); ++k)
    crossing.curve_error = std::max(crossing.curve_error, std::abs(curve[k] - crossing.curve[k]));
  crossing.curve = std::move(curve);
  crossing.gap_points = mesh.nodes();
  crossing.momentum_lines = mesh.lines;
  crossing.steps = mesh.steps;
}

void refine(PairCrossing& crossing, const ScaledPair& pair, const PairEquationOptions& options) {
  for (int level = 0; level < options.most_grids; ++level) {
    const PairMesh mesh = pair_mesh(pair, level);
    if (level >= kLeastGrids && mesh.work() > kMostWork) return;
    add_grid(crossing, mesh, solve(pair, mesh));
    if (level + 1 < kLeastGrids) continue;
    state_error(crossing, options.tolerance);
    if (level + 1 >= kUsualGrids && crossing.converged) return;
  }
}

}  // namespace

PairCrossing crossing_probability(const PairEquation& pair, const PairEquationOptions& options) {
  check(options);
  const auto began = std::chrono::steady_clock::now();
  const ScaledPair scaled = scaled_pair(pair);
  PairCrossing crossing;
  for (int k = 0; k <= kCurveIntervals; ++k) crossing.times.push_back(pair.time * k / kCurveIntervals);
  if (pair.beta == 0) {
    crossing.curve.assign(crossing.times.size(), 0);
    crossing.converged = true;
    return crossing;
  }
  refine(crossing, scaled, options);
  const auto within = [](double u) { return std::clamp(u, 0.0, 1.0); };
  for (std::vector<double>* curve : {&crossing.curve, &crossing.fine_curve})
    std::transform(curve->begin(), curve->end(), curve->begin(), within);
  crossing.probability = crossing.curve.back();
  crossing.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return crossing;
}

std::vector<PairCrossing> crossing_probabilities(const std::vector<PairEquation>& pairs,
                                                 const PairEquationOptions& options) {
  std::vector<PairCrossing> all(pairs.size());
  parallel_for(static_cast<int>(pairs.size()),
               [&](int i) { all[static_cast<std::size_t>(i)] = crossing_probability(pairs[i], options); });
  return all;
}

}  // namespace pulson::fokker_planck
