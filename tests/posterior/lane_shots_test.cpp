// The vector code of paths against the integrator.

#include "lane_shots.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "forced_target.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random_numbers.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

matching::MatchingProblem problem_of(const Points& source, const std::string& noise, const std::string& kernel) {
  return {{make_kernel(kernel, source), make_noise(noise, named_shape(source))},
          make_integrator("variational-2"),
          {1, 4},
          source,
          std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{source, 0.1, {}, {}}),
          0.1,
          20,
          {}};
}

class OfPaths : public testing::TestWithParam<std::tuple<int, std::string, std::string>> {};
INSTANTIATE_TEST_SUITE_P(All, OfPaths,
                         testing::Combine(testing::Values(1, 2, 3),
                                          testing::Values("none", "ch-sd:beta=0.05", "trouve-vialard:sigma=0.2",
                                                          "p-sd:beta=0.05", "p-sd:fields=grid,count=2,beta=0.1"),
                                          testing::Values("gaussian:alpha=0.5", "peakon:alpha=0.8",
                                                          "matern32:alpha=0.5+matern52:alpha=0.3,weight=0.5")),
                         [](const auto& row) { return "Case" + std::to_string(row.index); });

// Ends, derivatives and their products, to round-off.
TEST_P(OfPaths, AreThoseOfTheIntegrator) {
  const auto& [dimension, noise, kernel] = GetParam();
  Numbers numbers(5);
  const Points source = numbers.landmarks(dimension, 5);
  const matching::MatchingObjective objective(problem_of(source, noise, kernel));
  if (LaneShots::lanes() < 2) GTEST_SKIP() << "no vector of two numbers";
  ASSERT_TRUE(LaneShots::knows(objective));
  const Cohort cohort{named_shape(source), {named_shape(source)}};
  const Observation observation = observe(cohort, 0, 0.1);
  const MatrixXd slope = numbers(observation.count(), objective.unknowns());
  const MatrixXd z = 0.5 * numbers(objective.unknowns(), LaneShots::lanes());
  const auto sloped = LaneShots(objective, observation, slope).shoot(z, LaneShots::With::kSlopes);
  const auto changed = LaneShots(objective).shoot(z, LaneShots::With::kChanges);
  int found = 0;
  for (Index l = 0; l < z.cols(); ++l) {
    const auto lane = static_cast<std::size_t>(l);
    const auto at = objective.evaluate(z.col(l));
    ASSERT_EQ(at.has_value(), sloped.found[lane] != 0);
    if (!at) continue;
    ++found;
    const VectorXd end = at->path().final().q.reshaped();
    EXPECT_LE((sloped.ends.col(l) - end).norm(), 1e-12 * (1 + end.norm()));
    const MatrixXd changes = objective.endpoint_changes(at->path());
    EXPECT_LE((changed.changes[lane] - changes).norm(), 1e-11 * changes.norm());
    const MatrixXd product = observation.projection * changes * slope.transpose();
    EXPECT_LE((sloped.slopes[lane] - product).norm(), 1e-11 * product.norm());
  }
  EXPECT_GT(found, 0);
}

// Fewer than there are lanes, and some without a path.
TEST(LaneShots, LeaveOutThoseWithoutAPath) {
  const Points source = Eigen::RowVector3d(0, 0.4, 1);
  const matching::MatchingObjective objective(problem_of(source, "none", "gaussian:alpha=0.5"));
  if (LaneShots::lanes() < 2) GTEST_SKIP() << "no vector of two numbers";
  MatrixXd z = MatrixXd::Zero(objective.unknowns(), 2);
  z.col(1).setConstant(1e4);
  const auto shots = LaneShots(objective).shoot(z, LaneShots::With::kNothing);
  EXPECT_TRUE(shots.found[0]);
  EXPECT_FALSE(shots.found[1]);
  EXPECT_FALSE(objective.evaluate(z.col(1)).has_value());
  EXPECT_LE((shots.ends.col(0) - source.reshaped()).norm(), 1e-15);
}

TEST(LaneShots, DoNotKnowOtherNoiseNorManyLandmarks) {
  Numbers numbers(5);
  const auto is_known = [&](int landmarks, const std::string& noise) {
    return LaneShots::knows(
        matching::MatchingObjective(problem_of(numbers.landmarks(2, landmarks), noise, "gaussian:alpha=0.5")));
  };
  EXPECT_FALSE(is_known(5, "ch-sd-screened:beta=0.1,gamma=1"));
  EXPECT_FALSE(is_known(5, "langevin:sigma=0.1,friction=0.1"));
  EXPECT_FALSE(is_known(60, "none"));
}

// Fewer lanes than there are draws in a set, too.
TEST(LaneShots, GiveTheSameEvidenceOfSamplesWithAllVectorTargets) {
  const Landmarks source = oval(8);
  Points off(2, 8);
  for (Index i = 0; i < off.size(); ++i) off.reshaped()[i] = 0.2 * std::sin(3.0 * static_cast<double>(i));
  const Landmarks target = named_shape(source.points + off);
  CohortSettings settings = cohort_settings();
  settings.lambda = 10;
  settings.sampling_error = 0;
  settings.importance_samples = 16;
  const double evidence = fit_cohort({source, {target}}, "ch-sd:beta=0.05", settings).shapes.front().log_evidence;
  for (const std::int64_t vector : hwy::SupportedAndGeneratedTargets()) {
    const ForcedTarget forced(vector);
    EXPECT_NEAR(fit_cohort({source, {target}}, "ch-sd:beta=0.05", settings).shapes.front().log_evidence, evidence, 1e-3)
        << hwy::TargetName(vector);
  }
}

}  // namespace
}  // namespace pulson::compare
