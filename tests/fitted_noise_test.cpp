// Noise as a control: what it may not do, and what it leaves to the momenta.

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "pulson/matching/minimise.hpp"
#include "registration_problem.hpp"
#include "shape.hpp"

namespace pulson {
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
  const MatchingObjective still = outlines.objective();
  Points p = Points::Zero(2, 60);
  p.col(3) << 0.3, -0.2;
  p.col(40) << -0.1, 0.4;
  const auto geodesic = still.evaluate(still.white(p, MatrixXd::Zero(0, 20)));
  ASSERT_TRUE(geodesic.has_value());

  outlines.options.noise = GetParam();
  const MatchingObjective controlled = outlines.objective();
  const NoiseModel& noise = *controlled.problem().system.noise;
  ASSERT_TRUE(noise.traits().compensated);
  const auto path = controlled.evaluate(controlled.white(p, MatrixXd::Zero(noise.channels(2, 60), 20)));
  ASSERT_TRUE(path.has_value());
  EXPECT_LT((path->path().final().q - geodesic->path().final().q).cwiseAbs().maxCoeff(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Controls, CompensatedNoise,
                         testing::Values("ch-sd-screened:beta=0.5,gamma=0.4", "p-sd:beta=0.5,fields=grid"));

TEST(Controls, AreOfTheCompensatedSchemeWhereTheirProbabilityIsAsked) {
  Outlines outlines;
  outlines.options.noise = "p-sd:beta=0.5,fields=grid";
  const auto integrator = [&] { return outlines.objective().problem().integrator->name(); };
  EXPECT_EQ(integrator(), "variational-paper");
  outlines.options.uncertainty = true;
  EXPECT_EQ(integrator(), "variational");
  outlines.options.uncertainty = false;
  outlines.options.mode = MatchingMode::kPathwise;
  EXPECT_EQ(integrator(), "variational");
  outlines.options.mode.reset();
  outlines.options.integrator = "midpoint";
  EXPECT_EQ(integrator(), "midpoint");
}

// Rough momenta nearly cancel where they start, so that noise which parts such landmarks frees a flow that cost
// nothing: a search among all of them ends where the time step does, and not in a minimum.
TEST(Controls, DoWhatRoughMomentaWouldDo) {
  Outlines outlines;
  const double deterministic = minimise(outlines.objective(), {}).solution.cost.total();
  outlines.options.noise = "ch-sd:beta=0.3";
  const MatchingObjective objective = outlines.objective();
  const MinimiseSummary summary = minimise(objective, {});
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_LT(summary.resolved, objective.unknowns());
  EXPECT_LT(summary.solution.cost.total(), deterministic);
  EXPECT_GT(summary.solution.cost.total(), 0.5 * deterministic);
}

TEST(Controls, TakeNothingFromMomentaThatAreNotRough) {
  Outlines outlines{shape(ellipse(5, 1, 0)), shape(ellipse(5, 1.2, 0.3)), {.kernel = "gaussian:alpha=0.6"}};
  outlines.options.noise = "ch-sd:beta=30";
  const MatchingObjective objective = outlines.objective();
  EXPECT_EQ(std::ssize(objective.smooth_unknowns(1e-9)), objective.unknowns());
}

}  // namespace
}  // namespace pulson
