#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "combinations.hpp"
#include "error_of.hpp"
#include "numbers.hpp"
#include "pulson/compare/comparison.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::HasSubstr;

TEST(EnergyScore, IsItsDefinition) {
  Numbers numbers(5);
  const MatrixXd samples = numbers(4, 7);
  const VectorXd outcome = numbers(4, 1);
  double expected = 0;
  for (Index i = 0; i < 7; ++i) {
    expected += (samples.col(i) - outcome).norm() / 7;
    for (Index j = 0; j < 7; ++j) expected -= (samples.col(i) - samples.col(j)).norm() / (2 * 7 * 6);
  }
  EXPECT_NEAR(energy_score(samples, outcome), expected, 1e-14);
  VectorXd missing = outcome;
  missing[2] = kNaN;
  const std::vector<int> others = {0, 1, 3};
  EXPECT_DOUBLE_EQ(energy_score(samples, missing), energy_score(samples(others, Eigen::all), outcome(others)));
}

// A law of two points a and b: ½|a − y| + ½|b − y| − ½ · ½|a − b| in the limit of many samples, half of them a.
TEST(EnergyScore, OfALawOfTwoPoints) {
  constexpr Index kSamples = 2000;
  MatrixXd samples(2, kSamples);
  for (Index i = 0; i < kSamples; ++i) samples.col(i) = i % 2 == 0 ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(3, 4);
  EXPECT_NEAR(energy_score(samples, Eigen::Vector2d(0, 0)), 2.5 - 1.25, 5.0 / kSamples);
  EXPECT_NEAR(energy_score(samples, Eigen::Vector2d(3, 0)), 1.5 + 2 - 1.25, 5.0 / kSamples);
  const MatrixXd sure = VectorXd::Constant(3, 2).replicate(1, 2);
  EXPECT_EQ(energy_score(sure, VectorXd::Constant(3, 2)), 0);
  EXPECT_THAT(error_of([&] { energy_score(sure.leftCols(1), sure.col(0)); }), HasSubstr("two samples"));
}

// Of N(0, 1) by samples of N(0, 1): E|X − y| − ½E|X − X'| with y ~ N(0, 1) is √(4/π) − ½√(4/π) = 0.5642.
TEST(EnergyScore, OfTheRightLawIsHalfTheMeanDistance) {
  constexpr int kOutcomes = 2000;
  const MatrixXd samples = standard_normals(2, 0, 1, 400);
  const VectorXd outcomes = standard_normals(2, 1, kOutcomes, 1);
  double sum = 0;
  for (const double y : outcomes) sum += energy_score(samples, VectorXd::Constant(1, y)) / kOutcomes;
  // Deviation of |X − y| averaged over X is below 0.7; the samples add 0.6/√400 at most.
  EXPECT_NEAR(sum, std::sqrt(1 / std::numbers::pi), 3 * std::hypot(0.7 / std::sqrt(kOutcomes), 0.6 / 20));
}

TEST(Coverage, OfTheRightLawIsThePartAskedFor) {
  constexpr int kOutcomes = 3000;
  const MatrixXd samples = standard_normals(3, 0, kOutcomes, 1000);
  VectorXd outcomes = standard_normals(3, 1, kOutcomes, 1);
  const double error = std::sqrt(0.9 * 0.1 / kOutcomes);
  EXPECT_NEAR(coverage(samples, outcomes, 0.9), 0.9, 3 * error);
  EXPECT_NEAR(coverage(samples, outcomes, 0.5), 0.5, 3 * std::sqrt(0.25 / kOutcomes));
  outcomes.head(kOutcomes / 2).setConstant(kNaN);
  EXPECT_NEAR(coverage(samples, outcomes, 0.9), 0.9, 3 * error * std::sqrt(2.0));
}

TEST(Coverage, InterpolatesBetweenSamples) {
  const MatrixXd samples = Eigen::RowVectorXd::LinSpaced(11, 0, 10);
  const auto covered = [&](double y) { return coverage(samples, VectorXd::Constant(1, y), 0.9); };
  EXPECT_EQ(covered(0.51), 1);
  EXPECT_EQ(covered(9.49), 1);
  EXPECT_EQ(covered(0.49), 0);
  EXPECT_EQ(covered(9.51), 0);
}

TEST(Predict, TheRightModelCoversItsShapesAndOneThatIsTooSureDoesNot) {
  const Landmarks source = oval(8);
  const CohortSettings settings = cohort_settings();
  Cohort held = drawn_cohort(source, "ch-sd:beta=0.1", 50, settings, 60, 1);
  held.targets.front().points.col(3).setConstant(kNaN);
  const auto prediction_of = [&](double beta, double lambda) {
    const matching::MatchingProblem model =
        model_problem(source, "ch-sd:beta=" + std::to_string(beta), lambda, settings);
    return summary(predict(held, aligned_samples(held, model, 400, 7)));
  };
  const Prediction right = prediction_of(0.1, 50);
  const Prediction too_sure = prediction_of(0.1 / std::sqrt(10), 500);
  EXPECT_NEAR(right.coverage, 0.9, 0.05);  // 60 shapes of 16 coordinates that are correlated: ± 0.015
  EXPECT_LT(too_sure.coverage, 0.6);       // 1.645/√10 deviations: 0.40
  EXPECT_GT(too_sure.energy_score, right.energy_score + 2 * right.energy_score_error);
  ASSERT_EQ(right.shapes.size(), 60U);
  for (const ShapePrediction& shape : right.shapes) EXPECT_GT(shape.energy_score, 0);
}

// Samples are moved as the targets were: none differs from the source by more than a shape.
TEST(Predict, SamplesAreAlignedAsTheCohortIs) {
  const Landmarks source = oval(8);
  const matching::MatchingProblem model = model_problem(source, "ch-sd:beta=0.1", 50, cohort_settings());
  const MatrixXd plain = aligned_samples({source, {source}}, model, 20, 3);
  const MatrixXd aligned = aligned_samples({source, {source}, AlignmentKind::kRigid}, model, 20, 3);
  for (Index s = 0; s < 20; ++s) {
    const Points drawn = plain.col(s).reshaped(2, 8);
    const Points expected = align(drawn, source.points, AlignmentKind::kRigid).apply(drawn);
    EXPECT_LE((aligned.col(s) - expected.reshaped()).norm(), 1e-12);
  }
  EXPECT_GT((plain - aligned).norm(), 0.1);
}

TEST(Summary, IsTheMeanAndItsStandardError) {
  const Prediction all = summary({{1, 0.5}, {2, 1}, {6, 0.9}});
  EXPECT_DOUBLE_EQ(all.energy_score, 3);
  EXPECT_DOUBLE_EQ(all.energy_score_error, std::sqrt(7.0 / 3));
  EXPECT_DOUBLE_EQ(all.coverage, 0.8);
  EXPECT_TRUE(std::isnan(summary({{1, 0.5}}).energy_score_error));
}

}  // namespace
}  // namespace pulson::compare
