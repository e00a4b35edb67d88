#include "pulson/compare/predictive_checks.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "pulson/compare/comparison.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

CohortFit fit_of(const CohortSettings& settings) {
  CohortFit fit;
  fit.kernel = settings.kernel.spec();
  fit.noise = "none";
  fit.lambda = 50;
  fit.sigma = settings.sigma.in(2);
  return fit;
}

CohortShapes shapes_of(std::vector<Landmarks> targets) { return {{}, std::move(targets), AlignmentKind::kSimilarity}; }

// Of 8 cohorts three or more are refused in 6 of 1000 at the stated level of 5 %.
TEST(PredictiveChecks, SeldomRefuseTheModelThatDrewTheShapes) {
  const CohortSettings settings = cohort_settings();
  int refused = 0, landmarks_outside = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const CohortShapes shapes = shapes_of(drawn_shapes(oval(8), "none", 50, settings, 12, 900 + 10 * seed));
    const PredictiveChecks found = check_predictions(shapes, shapes.cohort(), fit_of(settings), settings, 99);
    if (!found.unexplained().empty()) ++refused;
    landmarks_outside += found.outside;
  }
  EXPECT_LE(refused, 2);
  // 10 % of 64, whose standard error is at most that of 8 independent cohorts, √(8·8²·0.09)
  EXPECT_NEAR(landmarks_outside, 6.4, 2 * std::sqrt(8 * 64 * 0.09));
}

TEST(PredictiveChecks, NameALandmarkThatVariesTooMuch) {
  const CohortSettings settings = cohort_settings();
  std::vector<Landmarks> targets = drawn_shapes(oval(8), "none", 50, settings, 20, 77);
  const Eigen::VectorXd more = standard_normals(5, 0, 40, 1);
  for (Eigen::Index s = 0; s < 20; ++s)
    targets[static_cast<std::size_t>(s)].points.col(2) += 0.5 * more.segment(2 * s, 2);
  const CohortShapes shapes = shapes_of(std::move(targets));
  const PredictiveChecks found = check_predictions(shapes, shapes.cohort(), fit_of(settings), settings);
  EXPECT_TRUE(found.variances[2].is_outside());
  EXPECT_EQ(found.variances[2].p_value, 0.01);
  EXPECT_EQ(found.variances_p, 0.005);
  ASSERT_FALSE(found.unexplained().empty());
  EXPECT_THAT(found.unexplained().front(), HasSubstr("of 8 landmarks"));
}

CompareOptions options_of_profile(const CohortSettings& settings) {
  CompareOptions options;
  options.settings = settings;
  options.folds = 0;
  options.forward_samples = 10;
  options.maps = false;
  return options;
}

// Scores at another sigma are those of fits with that sigma given, all by Laplace's approximation.
TEST(SigmaProfile, IsThatOfFitsWithThatSigma) {
  CohortSettings settings = cohort_settings();
  settings.importance_samples = 0;
  const CohortShapes shapes{oval(8), drawn_shapes(oval(8), "ch-sd:beta=0.1", 50, settings, 12, 31)};
  CompareOptions options = options_of_profile(settings);
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  ASSERT_TRUE(comparison.profile);
  const SigmaProfile& profile = *comparison.profile;
  const Eigen::Index last = profile.sigma.size() - 1;
  ASSERT_GE(last, 4);
  EXPECT_NEAR(profile.sigma[last], 0.02, 1e-12);
  options.checks = false;
  options.settings.sigma = 0.02;
  const Comparison other = compare_models(shapes, {"none", "ch-sd"}, options);
  for (Eigen::Index m = 0; m < 2; ++m) {  // the profile is corrected for steps as the fit that it goes out from
    const ComparedModel& from = comparison.models[static_cast<std::size_t>(m)];
    const ComparedModel& there = other.models[static_cast<std::size_t>(m)];
    EXPECT_NEAR(profile.scores(last, m) - from.fit.step_error.value, there.score - there.fit.step_error.value, 0.03);
  }
}

// At the sigma of the fits, scores and the evidences of the shapes are those of the fits, by draws.
TEST(SigmaProfile, IsThatOfTheFitsAtTheirSigma) {
  const CohortSettings settings = cohort_settings();
  const CohortShapes shapes{oval(8), drawn_shapes(oval(8), "ch-sd:beta=0.1", 50, settings, 12, 31)};
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options_of_profile(settings));
  ASSERT_TRUE(comparison.profile);
  const SigmaProfile& profile = *comparison.profile;
  const Eigen::Index middle = profile.sigma.size() / 2;
  ASSERT_NEAR(profile.sigma[middle], settings.sigma.in(0), 1e-12);
  for (Eigen::Index m = 0; m < 2; ++m) {
    const ComparedModel& model = comparison.models[static_cast<std::size_t>(m)];
    EXPECT_NEAR(profile.scores(middle, m), model.score, 0.001);
    EXPECT_LT((profile.shapes[static_cast<std::size_t>(middle)].col(m) - model.fit.log_evidences()).norm(), 0.001);
  }
}

// Where sigma is fitted in each model, one that is not distinguished from the best may have another.
TEST(SigmaProfile, SpansTheSigmasOfModelsThatAreNotDistinguished) {
  CohortSettings settings = cohort_settings();
  const CohortShapes shapes{oval(8), drawn_shapes(oval(8), "ch-sd:beta=0.02", 50, settings, 12, 32)};
  settings.fit_sigma = true;
  const CompareOptions options = options_of_profile(settings);
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  ASSERT_TRUE(comparison.profile);
  ASSERT_LT(std::abs(comparison.models[0].score - comparison.models[1].score), 3);
  const auto [low, high] = std::minmax(comparison.models[0].fit.sigma, comparison.models[1].fit.sigma);
  EXPECT_LT(low, 0.9 * high);
  const Eigen::VectorXd& sigma = comparison.profile->sigma;
  EXPECT_NEAR(sigma[0], std::max(low / 2, 2 * high / 256), 1e-9 * high);
  EXPECT_NEAR(sigma[sigma.size() - 1], 2 * high, 1e-9 * high);
}

// Noise takes all of one model's sigma, which is hundreds of times the other's.
TEST(SigmaProfile, IsNoHigherThanTheFits) {
  CohortSettings settings = cohort_settings();
  settings.kernel = "gaussian:alpha=1.5";
  settings.sigma = 0.004;
  const CohortShapes shapes{oval(8), drawn_shapes(oval(8), "ch-sd:beta=0.05", 50, settings, 6, 33)};
  settings.fit_sigma = true;
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options_of_profile(settings));
  ASSERT_TRUE(comparison.profile);
  const Eigen::MatrixXd& scores = comparison.profile->scores;
  ASSERT_FALSE(comparison.models[0].is_behind());
  ASSERT_FALSE(comparison.models[1].is_behind());
  ASSERT_GT(comparison.models[0].fit.sigma, 50 * comparison.models[1].fit.sigma);
  for (const Eigen::Index m : {0, 1}) {
    const double of_fit = comparison.models[static_cast<std::size_t>(m)].score;
    EXPECT_NEAR(scores.col(m).maxCoeff(), of_fit, 0.5) << scores;
  }
}

// Where the verdict changes is found within 5 %, and fits with σ given on either side say so.
TEST(SigmaProfile, ChangesWhereFitsDo) {
  CohortSettings settings = cohort_settings();
  settings.kernel = "gaussian:alpha=1.5";  // so wide that it is no noise of single landmarks
  const CohortShapes shapes{oval(8), drawn_shapes(oval(8), "ch-sd:beta=0.05", 50, settings, 12, 31)};
  CompareOptions options = options_of_profile(settings);
  options.settings.sigma = 0.03;
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  const auto ranges = comparison.profile->ranges(comparison);
  ASSERT_GE(ranges.size(), 2U) << comparison.profile->scores;
  EXPECT_TRUE(ranges[0].has_noise);
  EXPECT_FALSE(ranges[1].has_noise);
  EXPECT_EQ(ranges[0].high, ranges[1].low);
  options.checks = false;
  for (const double factor : {0.9, 1.1}) {
    options.settings.sigma = factor * ranges[0].high;
    const Comparison there = compare_models(shapes, {"none", "ch-sd"}, options);
    EXPECT_EQ(there.models[0].is_behind(), factor < 1) << there.models[0].difference.value;
  }
}

// A noise that is decisive in every shape at σ = 1, at σ = 2 in the sum alone, and behind at σ = 4.
TEST(SigmaProfile, SaysWhereTheVerdictChanges) {
  Comparison comparison;
  comparison.models.resize(2);
  comparison.models[0].noise = "none";
  comparison.models[1].noise = "ch-sd";
  SigmaProfile profile;
  profile.sigma = Eigen::Vector3d(1, 2, 4);
  profile.scores.resize(3, 2);
  profile.scores << 0, 9, 0, 9, 0, -20;
  profile.shapes.assign(3, Eigen::MatrixXd::Zero(3, 2));
  profile.shapes[0].col(1).setConstant(3);
  profile.shapes[1].col(1) << 12, -1, -2;  // two standard errors are 27
  profile.shapes[2].col(1).setConstant(-7);
  const auto ranges = profile.ranges(comparison);
  ASSERT_EQ(ranges.size(), 3U);
  EXPECT_TRUE(ranges[0].has_noise);
  EXPECT_THAT(ranges[0].models, ElementsAre(1U));
  EXPECT_EQ(ranges[0].low, 1);
  EXPECT_NEAR(ranges[0].high, std::sqrt(2.0), 1e-12);
  EXPECT_FALSE(ranges[1].has_noise);
  EXPECT_TRUE(ranges[1].is_favoured);
  EXPECT_NEAR(ranges[1].high, std::sqrt(8.0), 1e-12);
  EXPECT_FALSE(ranges[2].has_noise);
  EXPECT_FALSE(ranges[2].is_favoured);
  EXPECT_EQ(ranges[2].high, 4);
  profile.shapes[1] = profile.shapes[2] = profile.shapes[0];
  profile.scores.col(1).setConstant(9);
  EXPECT_EQ(profile.ranges(comparison).size(), 1U);
}

}  // namespace
}  // namespace pulson::compare
