// Noise as a control: what it may not do, and what it leaves to the momenta.

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "pulson/matching/objective.hpp"
#include "registration_problem.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// A circle, or an ellipse with a bump, of `count` landmarks.
Points ellipse(Index count, double stretch, double bump) {
  Points points(2, count);
  for (Index a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(a) / static_cast<double>(count);
    const double radius = 1 + bump * std::exp(-8 * std::pow(angle - 1, 2));
    points.col(a) << stretch * radius * std::cos(angle), radius * std::sin(angle) / stretch;
  }
  return points;
}

struct Outlines {
  Landmarks source = shape(ellipse(60, 1, 0));
  Landmarks target = shape(ellipse(60, 1.2, 0.3));
  RegistrationOptions options{
      .kernel = "gaussian:alpha=0.6", .sigma = 0.002, .lambda = 1, .align = AlignmentKind::kNone};

  MatchingObjective objective() const { return MatchingObjective(make_problem(source, target, options).matching); }
};

class CompensatedNoise : public testing::TestWithParam<std::string> {};

// Else a match without noise could cost less than with it.
TEST_P(CompensatedNoise, LeavesTheGeodesicAloneWhereItsControlsAreZero) {
  Outlines outlines;
  outlines.source.groups.assign(60, "left");
  std::fill(outlines.source.groups.begin() + 30, outlines.source.groups.end(), "right");
  outlines.options.integrator = "variational-2";
  const MatchingObjective still = outlines.objective();
  Points p = Points::Zero(2, 60);
  p.col(3) << 0.3, -0.2;
  p.col(40) << -0.1, 0.4;
  const auto geodesic = still.evaluate(still.white(p, MatrixXd::Zero(0, 20)));
  ASSERT_TRUE(geodesic.has_value());

  outlines.options.noise = GetParam();
  outlines.options.mode = MatchingMode::kMap;
  const MatchingObjective controlled = outlines.objective();
  const NoiseModel& noise = *controlled.problem().system.noise;
  ASSERT_TRUE(noise.traits().compensated);
  const auto path = controlled.evaluate(controlled.white(p, MatrixXd::Zero(noise.channels(2, 60), 20)));
  ASSERT_TRUE(path.has_value());
  EXPECT_LT((path->path().final().q - geodesic->path().final().q).cwiseAbs().maxCoeff(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Controls, CompensatedNoise,
                         testing::Values("ch-sd-screened:beta=0.5,gamma=0.4", "p-sd:beta=0.5,fields=grid"));

TEST(Controls, LowerTheCostOfAMatch) {
  Outlines outlines;
  const MinimiseSummary deterministic = minimise(outlines.objective(), {});
  outlines.options.noise = "ch-sd:beta=0.3";
  outlines.options.mode = MatchingMode::kMap;
  const MinimiseSummary summary = minimise(outlines.objective(), {});
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_LT(summary.solution.cost.total(), deterministic.solution.cost.total());
  EXPECT_GT(summary.solution.cost.total(), 0.5 * deterministic.solution.cost.total());
}

TEST(Integrators, AreChosenByMode) {
  Outlines outlines;
  const auto integrator = [&] { return outlines.objective().problem().integrator->name(); };
  EXPECT_EQ(integrator(), "rk4");
  outlines.options.minimise.solver = Solver::kGaussNewton;
  EXPECT_EQ(integrator(), "variational-2");
  outlines.options.minimise.solver = Solver::kAuto;
  outlines.options.noise = "p-sd:beta=0.5,fields=grid";
  EXPECT_EQ(integrator(), "midpoint");
  outlines.options.uncertainty = true;
  EXPECT_EQ(integrator(), "variational-2");
  outlines.options.uncertainty = false;
  outlines.options.mode = MatchingMode::kPathwise;
  EXPECT_EQ(integrator(), "variational");
  outlines.options.integrator = "heun";
  EXPECT_EQ(integrator(), "heun");
}

}  // namespace
}  // namespace pulson::matching
