// Searches over paths: closed forms, conservation, replays and limits.

#include "path_search.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "path_examples.hpp"

namespace pulson::matching {
namespace {

TEST(PathSearch, SwapsOnALineAtTheCostOfTheClosedForm) {
  const std::vector<std::tuple<double, double, double>> published = {
      {0.5, 1, 2.2539}, {1, 1, 0.8132}, {2, 1, 0.2355}, {1, 10, 0.9756}};
  for (const auto& [beta, lambda, cost] : published) {
    SCOPED_TRACE(beta);
    const double limit = swap_cost(beta, lambda);
    EXPECT_NEAR(limit, cost, 6e-5);
    std::vector<double> sizes, errors;
    for (const int steps : {10, 20, 40}) {
      const PathSolution found = swap_on_a_line(beta, lambda, steps).search();
      EXPECT_LE(found.iterations, 10);
      sizes.push_back(1.0 / steps);
      errors.push_back(std::abs(found.cost.total() - limit));
    }
    EXPECT_LE(errors.back(), 1e-4 * limit);
    EXPECT_NEAR(fitted_order(sizes, errors), 2, 0.1);
  }
}

TEST(PathSearch, ConservesTheEffectiveHamiltonian) {
  for (const std::string& noise : linear_noise_specs()) {
    SCOPED_TRACE(noise);
    std::vector<double> sizes, changes;
    for (const int steps : {10, 20, 40}) {
      PathMatch match = nearby_shapes(noise);
      match.grid.steps = steps;
      const PathSolution found = match.search();
      const EffectiveHamiltonian system(match.problem().system, match.lambda);
      std::vector<double> values;
      for (const PhaseState& middle : found.path.middles) values.push_back(system.value(middle));
      const auto [least, most] = std::minmax_element(values.begin(), values.end());
      sizes.push_back(1.0 / steps);
      changes.push_back((*most - *least) / *least);
      EXPECT_NEAR(found.cost.energy + found.cost.action, match.lambda * values.front(), 3e-4 * values.front());
    }
    EXPECT_NEAR(fitted_order(sizes, changes), 2, 0.25);
    EXPECT_LE(changes.back(), 1e-4);
  }
}

// But for the regularisation, εK(0)p, which no record has.
TEST(PathSearch, RecordsReplay) {
  std::vector<PathMatch> matches{swap_on_a_line(0.5, 1, 40), swap_on_a_line(1, 1, 40)};
  for (const std::string& noise : linear_noise_specs()) matches.push_back(nearby_shapes(noise));
  for (const PathMatch& match : matches) {
    SCOPED_TRACE(match.noise);
    const MatchingProblem problem = match.problem();
    const PathSolution found = match.search();
    const Trajectory path =
        make_integrator("midpoint")
            ->integrate(problem.system, {match.source, found.momenta}, match.grid, found.increments);
    const double error = largest(path.final().q - found.path.end());
    EXPECT_LE(error, 5 * regularisation(problem.system.kernel) * match.grid.time * largest(found.momenta));
    if (match.sigma > 1e-4) {
      EXPECT_LE(error, 1e-6 * match.sigma);
    }
    for (std::size_t k = 0; k < found.path.nodes.size(); ++k)
      EXPECT_LE(largest(path.states[k].q - found.path.nodes[k]), 1e-9);
  }
}

TEST(PathSearch, CostIsThatOfItsPath) {
  for (const std::string& noise : linear_noise_specs()) {
    SCOPED_TRACE(noise);
    PathMatch match = nearby_shapes(noise);
    match.lambda = 2.5;
    const PathSolution found = match.search();
    const MatchingProblem problem = match.problem();
    double energy = 0;
    for (const PhaseState& middle : found.path.middles)
      energy += match.lambda * match.grid.dt() * hamiltonian(problem.system.kernel, middle);
    EXPECT_NEAR(found.cost.energy, energy, 1e-8 * energy);
    EXPECT_NEAR(found.cost.action, 0.5 * found.increments.squaredNorm() / match.grid.dt(), 1e-12 * energy);
    EXPECT_EQ(found.cost.data, problem.data->value(found.path.end()));
  }
}

TEST(PathSearch, TendsToLddmmWhereNoiseVanishes) {
  const PathSolution limit = nearby_shapes("none").search();
  std::vector<double> betas{0.1, 0.03, 0.01}, differences;
  for (const double beta : betas) {
    const double cost = nearby_shapes(ch_sd(beta)).search().cost.total();
    EXPECT_LT(cost, limit.cost.total());
    differences.push_back(limit.cost.total() - cost);
  }
  EXPECT_NEAR(fitted_order(betas, differences), 2, 0.05);
  const PathSolution last = nearby_shapes(ch_sd(1e-4)).search();
  EXPECT_NEAR(last.cost.total(), limit.cost.total(), 1e-6 * limit.cost.total());
  EXPECT_LE((last.momenta - limit.momenta).norm(), 1e-6 * limit.momenta.norm());
}

TEST(PathSearch, TendsToStraightLinesWhereNoiseIsLarge) {
  for (const double beta : {10.0, 100.0, 1000.0}) {
    const PathMatch match = nearby_shapes(ch_sd(beta));
    const PathSolution found = match.search();
    const Points moved = match.target - match.source;
    const double limit = 0.5 * moved.squaredNorm() / (beta * beta + match.sigma * match.sigma);
    EXPECT_NEAR(found.cost.total(), limit, 2 / (beta * beta) * limit);
    EXPECT_LE((beta * beta * found.momenta - moved).norm(), 2 / (beta * beta) * moved.norm());
    EXPECT_LE(found.iterations, 5);
  }
}

TEST(PathSearch, OfEqualShapesCostsNothing) {
  for (const std::string& noise : linear_noise_specs())
    for (const double shift : {0.0, 1e-12}) {
      PathMatch match = nearby_shapes(noise);
      match.target = match.source.array() + shift;
      const PathSolution found = match.search();
      EXPECT_LE(found.iterations, 1);
      EXPECT_LE(found.cost.total(), 1e-12);
      EXPECT_EQ(found.momenta.norm(), 0);
    }
}

}  // namespace
}  // namespace pulson::matching
