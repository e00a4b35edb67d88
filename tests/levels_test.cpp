// Smooth momenta first; and searches that end where the time step does, not in a minimum.

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "match.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using testing::HasSubstr;

// A circle of 40 landmarks to an ellipse with a bump, its data held firmly.
Match bump(int steps) {
  Match match{Points(2, 40), Points(2, 40)};
  for (Index a = 0; a < 40; ++a) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(a) / 40;
    const double radius = 1 + 0.3 * std::exp(-8 * std::pow(angle - 1, 2));
    match.source.col(a) << std::cos(angle), std::sin(angle);
    match.target.col(a) << 1.2 * radius * std::cos(angle), radius * std::sin(angle) / 1.2;
  }
  match.kernel = "gaussian:alpha=0.6";
  match.sigma = 0.002;
  match.grid.steps = steps;
  return match;
}

TEST(Levels, EndWithAllUnknownsThatTheStepsResolve) {
  const Match match = bump(20);
  const MatchingObjective objective = match.objective();
  const MinimiseSummary summary = minimise(objective, {});
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_EQ(summary.resolved, std::ssize(objective.smooth_unknowns(1e-3)));
  EXPECT_LT(summary.resolved, objective.unknowns());
}

// Five steps do not resolve the rougher momenta: with these the cost falls while its gradient grows.
TEST(Levels, ReturnToTheSmoothOnesWhereRougherOnesRunAway) {
  const Match match = bump(5);
  const MatchingObjective objective = match.objective();
  const std::ptrdiff_t smooth = std::ssize(objective.smooth_unknowns(0.1));
  ASSERT_LT(smooth, std::ssize(objective.smooth_unknowns(1e-2)));
  const MinimiseSummary summary = minimise(objective, {});
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_EQ(summary.resolved, smooth);
  EXPECT_LE(summary.relative_gradient, MinimiseOptions().gradient_tolerance);
}

// Cheap noise draws the squares together, where the same momenta carry them faster: no step gains what it promises.
TEST(Searches, EndWhereStepsGainLittle) {
  Match match{Points(2, 8), {}};
  int a = 0;
  for (const double side : {-0.5, 0.5})
    for (const double x : {-0.1, 0.1})
      for (const double y : {-0.1, 0.1}) match.source.col(a++) << side + x, y;
  match.target = -match.source;
  match.kernel = "gaussian:alpha=0.4";
  match.noise = "ch-sd:beta=1";
  match.sigma = 0.01;
  match.grid.steps = 10;
  const MinimiseSummary summary = minimum(match, {});
  EXPECT_FALSE(summary.converged);
  EXPECT_THAT(summary.reason, HasSubstr("the next steps leave what the time step can resolve"));
  EXPECT_GT(summary.relative_gradient, 0.1);
  EXPECT_LT(summary.iterations, MinimiseOptions().max_iterations);
}

// A line that is rolled up by more than a turn: no direct search arrives, nor one that moves rough momenta while the
// data are held loosely.
TEST(Continuation, MovesWhatIsSmoothForDataHeldSoFirmly) {
  Match match{Points(2, 31), Points(2, 31)};
  for (Index a = 0; a < 31; ++a) {
    const double part = static_cast<double>(a) / 30;
    const double angle = 400 * std::numbers::pi / 180 * part;
    match.source.col(a) << 3 * part - 1.5, 0;
    match.target.col(a) << (0.9 - 0.55 * part) * std::cos(angle), (0.9 - 0.55 * part) * std::sin(angle);
  }
  match.kernel = "gaussian:alpha=0.9";
  match.sigma = 0.003;
  const MinimiseSummary summary = minimum(match, {});
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_GT(summary.continuation_stages, 0);
  EXPECT_LE(summary.solution.cost.data, 0.5 * 9 * 62);
}

}  // namespace
}  // namespace pulson
