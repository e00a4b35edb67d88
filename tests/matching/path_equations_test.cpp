// Paths of many landmarks with noise of each, against the dense model of the cost of a path.

#include "path_equations.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "path_model.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Points of a disc in a spiral, bent; one that is not observed, one of which a coordinate is, one that counts for less.
MatchingProblem disc_problem(Index n, const std::string& noise) {
  Points source(2, n), target(2, n);
  for (Index a = 0; a < n; ++a) {
    const double r = std::sqrt((static_cast<double>(a) + 0.5) / static_cast<double>(n));
    const double t = std::numbers::pi * (1 + std::sqrt(5.0)) * static_cast<double>(a);
    source.col(a) << r * std::cos(t), r * std::sin(t);
    const double x = source(0, a), y = source(1, a);
    target.col(a) << 1.2 * x + 0.3 * y * y, 0.9 * y + 0.2 * std::sin(2 * x) + 0.01 * std::cos(40 * t);
  }
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  target.col(7).setConstant(kNaN);
  target(1, 20) = kNaN;
  VectorXd weights = VectorXd::Ones(n);
  weights[30] = 0.25;
  Landmarks shape;
  shape.points = source;
  return {{make_kernel("gaussian:alpha=0.8", source), make_noise(noise, shape)},       nullptr, {1, 10}, source,
          std::make_shared<LandmarkTerm>(LandmarkObservations{target, 0.01, weights}), 0.01,    2};
}

// A path of search_paths for so many landmarks is that of the equations, without matrices; the dense model is another
// way to the derivatives of the same cost.
TEST(PathEquations, EndWhereTheCostOfThePathIsStationary) {
  const MatchingProblem problem = disc_problem(320, "ch-sd:beta=0.1");
  const PathSolution found = search_paths(problem, {});
  ASSERT_TRUE(found.converged) << found.reason;
  ASSERT_TRUE(found.path.cometrics.empty());
  const EffectiveHamiltonian system(problem.system, problem.lambda);
  const std::optional<DiscretePath> path = along(system, problem.grid, found.path.nodes);
  ASSERT_TRUE(path);
  for (std::size_t k = 0; k < path->middles.size(); ++k) {
    const Points& p = path->middles[k].p;
    EXPECT_LE((found.path.middles[k].p - p).norm(), 1e-6 * p.norm());
  }
  EXPECT_NEAR(found.path.energy, path->energy, 1e-9 * path->energy);
  const PathModel model(system, *problem.data, *path, 1 / problem.lambda);
  const NodeCovector gradient = model.gradient();
  const double slope = pairing(gradient, model.solve(gradient));
  const double cost = path->energy + problem.data->value(path->end()) / problem.lambda;
  EXPECT_LE(std::sqrt(std::abs(slope) / (2 * cost)), 1e-8);
  EXPECT_NEAR(found.cost.total(), problem.lambda * cost, 1e-9 * found.cost.total());
}

TEST(PathEquations, AreNotForLandmarksWithoutNoiseOfTheirOwn) {
  const MatchingProblem problem = disc_problem(320, "none");
  EXPECT_FALSE(solve_path_equations(problem, {}, {}));
}

// What a landmark's own noise does is left to the data.
TEST(PathEquations, WithoutOwnNoiseTheDataAreLessFirm) {
  const MatchingProblem problem = disc_problem(40, "ch-sd:beta=0.1");
  const MatchingProblem smooth = without_own_noise(problem);
  EXPECT_EQ(smooth.system.noise->channels(2, 40), 0);
  const LandmarkTerm& data = *smooth.data->landmarks();
  EXPECT_NEAR(data.precision(0)(0, 0), 1 / (1e-4 + 1e-2), 1e-9);
  EXPECT_NEAR(data.precision(30)(1, 1), 1 / (4e-4 + 1e-2), 1e-9);
  EXPECT_TRUE(data.precision(7).isZero(0));
  EXPECT_EQ(data.precision(20)(1, 1), 0);
}

}  // namespace
}  // namespace pulson::matching
