#include "pulson/compare/comparison.hpp"

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "error_of.hpp"
#include "open_noise.hpp"
#include "pulson/core/parallel.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using testing::HasSubstr;

Landmarks line(int count) {
  return named_shape(Points(Eigen::RowVectorXd::LinSpaced(count, 0, 0.5 * (count - 1))), "line.csv");
}

CompareOptions quick() {
  CompareOptions options;
  options.settings = cohort_settings();
  options.settings.kernel = "gaussian:alpha=1";
  options.folds = 0;
  options.forward_samples = 400;
  return options;
}

void expect_ranked(const Comparison& comparison) {
  const ComparedModel& best = comparison.models[comparison.best];
  EXPECT_EQ(best.difference.value, 0);
  double weights = 0;
  for (const ComparedModel& model : comparison.models) {
    EXPECT_LE(model.score, best.score);
    EXPECT_DOUBLE_EQ(model.difference.value, model.score - best.score);
    EXPECT_EQ(model.score, model.fit.score());
    EXPECT_NEAR(model.weight / best.weight, std::exp(model.difference.value), 1e-12);
    weights += model.weight;
  }
  EXPECT_NEAR(weights, 1, 1e-12);
}

// No flow of a line changes the order of its points.
TEST(CompareModels, ReversalsOnALineCallForNoiseInThePositions) {
  CompareOptions options = quick();
  options.settings.sigma = 0.05;
  options.settings.grid.steps = 40;  // by 20 geodesics of so large momenta pass over landmarks
  const Landmarks source = line(6);
  CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.6", 20, options.settings, 10, 1)};
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  EXPECT_EQ(comparison.best, 1U);
  expect_ranked(comparison);
  const ComparedModel& stochastic = comparison.models[1];
  EXPECT_GT(stochastic.order_inversions.value, 0.3);
  EXPECT_EQ(comparison.models[0].order_inversions.value, 0);
  EXPECT_TRUE(std::isnan(stochastic.flipped_triangles.value));
  EXPECT_GT(stochastic.folded_fraction.value, 0);
  EXPECT_EQ(comparison.models[0].folded_fraction.value, 0);
  EXPECT_GT(stochastic.noise_displacement.minCoeff(), 0.05);
  EXPECT_FALSE(stochastic.prediction.has_value());
  // Of least cost with the same numbers: metamorphoses reverse, geodesics cannot.
  ASSERT_TRUE(stochastic.paths && comparison.models[0].paths);
  EXPECT_GT(stochastic.matched, comparison.models[0].matched);
  EXPECT_GT(stochastic.paths->matched, comparison.models[0].paths->matched);
  EXPECT_GT(stochastic.paths->order_inversions.value, 0.3);
  EXPECT_EQ(comparison.models[0].paths->order_inversions.value, 0);
  EXPECT_GT(comparison.models[0].paths->total.value, stochastic.paths->total.value);
}

// And its evidence is tested against that of no noise.
TEST(CompareModels, ASumOfWhichOneTermVanishesIsNoise) {
  CompareOptions options = quick();
  options.settings.sigma = 0.05;
  const Landmarks source = line(6);
  CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.6", 20, options.settings, 10, 2)};
  const ComparedModel sum = compare_models(shapes, {"none", "ch-sd+trouve-vialard"}, options).models[1];
  EXPECT_EQ(std::count_if(sum.fit.fitted.begin(), sum.fit.fitted.end(),
                          [](const FittedNumber& number) { return number.scales_noise && number.vanishes; }),
            1);
  EXPECT_FALSE(sum.fit.noise_vanishes());
  EXPECT_LT(sum.p_value, 1e-3);
}

TEST(CompareModels, SmoothShapesOnALineDoNot) {
  CompareOptions options = quick();
  const Landmarks source = line(6);
  const CohortShapes shapes{source, drawn_shapes(source, "none", 20, options.settings, 12, 2)};
  const Comparison comparison = compare_models(shapes, {"ch-sd", "none"}, options);
  EXPECT_EQ(comparison.best, 1U);
  expect_ranked(comparison);
  EXPECT_EQ(comparison.models[1].order_inversions.value, 0);
  EXPECT_EQ(comparison.models[1].folded_fraction.value, 0);
  EXPECT_EQ(comparison.models[1].noise_displacement.norm(), 0);
}

TEST(CompareModels, TheRightModelHasTheSpectrumThatIsSeenAndForetells) {
  CompareOptions options = quick();
  options.folds = 3;
  options.maps = false;
  const Landmarks source = oval(8);
  const CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.06", 50, options.settings, 20, 3)};
  std::vector<std::string> calls;
  options.on_model = [&](int model, const std::string& noise) { calls.push_back(std::to_string(model) + noise); };
  const Comparison comparison = compare_models(shapes, {"ch-sd", "none"}, options);
  EXPECT_THAT(calls, testing::ElementsAre("1none", "0ch-sd"));
  EXPECT_EQ(comparison.best, 0U);
  const ComparedModel& right = comparison.models.front();
  for (Eigen::Index i = 0; i < 8; ++i) {
    EXPECT_LE(std::abs(right.spectrum[i] - comparison.observed[i]), 4 * comparison.observed_error[i]) << i;
    if (i > 0) {
      EXPECT_LE(comparison.eigenvalues[i], comparison.eigenvalues[i - 1]);
    }
  }
  ASSERT_TRUE(right.prediction.has_value());
  EXPECT_EQ(right.prediction->shapes.size(), 20U);
  EXPECT_NEAR(right.prediction->coverage, 0.9, 0.06);
  EXPECT_LT(right.prediction->energy_score, comparison.models[1].prediction->energy_score);
  EXPECT_TRUE(std::isnan(right.folded_fraction.value));
  EXPECT_EQ(right.lost_samples, 0);
}

// Models begin at that without noise, wherever it is named, and are fitted at the same time.
TEST(CompareModels, NeitherOrderNorThreadsChangeANumber) {
  CompareOptions options = quick();
  options.folds = 3;
  const Landmarks source = oval(6);
  const CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.06", 50, options.settings, 8, 3)};
  set_thread_count(1);
  const Comparison one = compare_models(shapes, {"none", "ch-sd", "trouve-vialard"}, options);
  set_thread_count(3);
  const Comparison three = compare_models(shapes, {"trouve-vialard", "ch-sd", "none"}, options);
  set_thread_count(0);
  ASSERT_EQ(three.models.size(), 3U);
  for (std::size_t m = 0; m < 3; ++m) {
    const ComparedModel& model = one.models[m];
    const ComparedModel& same = three.models[2 - m];
    EXPECT_EQ(model.noise, same.noise);
    EXPECT_EQ(model.score, same.score);
    EXPECT_EQ(model.fit.lambda, same.fit.lambda);
    EXPECT_EQ(model.prediction->energy_score, same.prediction->energy_score);
  }
  ASSERT_TRUE(one.profile && three.profile);
  EXPECT_EQ(one.profile->scores, three.profile->scores.rowwise().reverse());
}

TEST(CompareModels, OneTargetHasNoPredictionAndNoErrors) {
  CompareOptions options = quick();
  options.folds = 5;
  options.settings.importance_samples = 20;
  const Landmarks source = line(4);
  const CohortShapes shapes{source, drawn_shapes(source, "none", 20, options.settings, 1, 4)};
  const Comparison comparison = compare_models(shapes, {"none"}, options);
  const ComparedModel& model = comparison.models.front();
  EXPECT_FALSE(model.prediction.has_value());
  EXPECT_TRUE(std::isnan(model.rms.standard_error));
  EXPECT_EQ(model.weight, 1);
  EXPECT_GT(model.fit.effective_part, 0);
  EXPECT_LE(model.fit.effective_part, 1);
}

TEST(CompareModels, ANoiseThatMadeTheShapesHasASmallProbabilityByChance) {
  CompareOptions options = quick();
  options.settings = cohort_settings();
  options.bootstrap = 4;
  const Landmarks source = oval(6);
  const CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.2", 50, options.settings, 8, 4)};
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  EXPECT_TRUE(std::isnan(comparison.models[0].p_value));
  EXPECT_EQ(comparison.models[1].bootstrapped, 4);
  EXPECT_DOUBLE_EQ(comparison.models[1].p_value, 0.2);  // more than in any of the four without noise
  options.bootstrap = 0;
  EXPECT_LT(compare_models(shapes, {"none", "ch-sd"}, options).models[1].p_value, 1e-3);
}

// The error of the cohort's evidence grows with the number of shapes, and what draws gain at a maximum does not.
TEST(SampleCohort, WhetherDrawsAreEnoughDoesNotDependOnTheNumberOfShapes) {
  const Landmarks source = oval(6);
  for (const auto& [noise, enough] : {std::pair{"ch-sd:beta=0.085", true}, std::pair{"ch-sd:beta=0.25", false}}) {
    CohortSettings settings = cohort_settings();
    settings.kernel = "gaussian:alpha=1";
    settings.importance_samples = 16;
    settings.lambda = 3;
    Cohort few = drawn_cohort(source, noise, 3, settings, 4, 5), many = few;
    for (int copy = 1; copy < 20; ++copy)
      many.targets.insert(many.targets.end(), few.targets.begin(), few.targets.end());
    for (const Cohort& shapes : {few, many}) {
      const CohortModel model(shapes, make_open_noise(noise, source), settings);
      const Matches matches = model.match(model.start(), nullptr, CohortModel::Effort::kThorough);
      std::vector<DrawStarts> starts;
      const SampledCohort sampled = sample_cohort(model, matches.x, matches, 16, starts);
      EXPECT_EQ(sampled.enough, enough) << shapes.targets.size() << " shapes, variance " << sampled.variance;
      if (enough && shapes.targets.size() > 4) {
        EXPECT_GT(std::sqrt(sampled.variance), 1) << "nats, so that a bound on it would refuse them";
      }
    }
  }
}

// Large displacements of landmarks that are known exactly: too few draws are effective of some shapes.
TEST(CompareModels, TheEvidenceOfAShapeIsOfOneKindInAllModels) {
  CompareOptions options = quick();
  options.settings.importance_samples = 40;
  const Landmarks source = oval(8);
  const CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.8", 10, options.settings, 8, 5)};
  const Comparison comparison = compare_models(shapes, {"none", "ch-sd"}, options);
  std::size_t few = 0;
  for (std::size_t s = 0; s < shapes.targets.size(); ++s) {
    bool is_few = false;
    for (const ComparedModel& model : comparison.models) {
      const ShapeFit& shape = model.fit.shapes[s];
      is_few = is_few || shape.effective_samples < 0.1 * shape.samples || shape.samples == 0;
    }
    if (is_few) ++few;
    for (const ComparedModel& model : comparison.models) {
      EXPECT_EQ(model.fit.shapes[s].log_evidence == model.fit.shapes[s].laplace, is_few);
      EXPECT_EQ(model.fit.shapes[s].variance == 0, is_few);
    }
  }
  ASSERT_GT(few, 0U);
  for (const ComparedModel& model : comparison.models) {
    double sum = 0;
    for (const ShapeFit& shape : model.fit.shapes) sum += shape.log_evidence;
    EXPECT_NEAR(model.fit.log_evidence, sum, 1e-9);
    EXPECT_EQ(model.score, model.fit.score());
  }
  EXPECT_THAT(comparison.notes, testing::Contains(HasSubstr("is that of Laplace's approximation, in every model")));
}

// The note has one number for both, at T = 2.
TEST(CompareModels, IndependentVariationIsThatOfNoiseAndSigma) {
  CompareOptions options = quick();
  options.settings.fit_sigma = true;
  options.settings.importance_samples = 0;
  options.settings.grid.time = 2;
  const Landmarks source = oval(6);
  const CohortShapes shapes{source, drawn_shapes(source, "ch-sd:beta=0.1", 20, options.settings, 10, 4)};
  const Comparison comparison = compare_models(shapes, {"ch-sd"}, options);
  const CohortFit& fit = comparison.models.front().fit;
  const double of_noise = std::sqrt(2.0) * fitted_number(fit, "beta").value;
  EXPECT_GT(of_noise, 10 * fit.sigma);
  const std::string both = fmt::format("landmarks, {:.3g}, may be", std::hypot(fit.sigma, of_noise));
  EXPECT_THAT(comparison.notes, testing::Contains(HasSubstr(both)));
}

TEST(CompareModels, AboutTheMeanOfShapesThatLieAnyhow) {
  CompareOptions options = quick();
  options.settings.kernel = "gaussian:alpha=auto";
  options.folds = 2;
  CohortShapes shapes{{}, drawn_shapes(oval(6), "none", 50, cohort_settings(), 6, 5), AlignmentKind::kSimilarity};
  for (std::size_t s = 0; s < 6; ++s)
    shapes.targets[s].points = (shapes.targets[s].points * (1 + 0.1 * static_cast<double>(s))).array() + 1;
  const Comparison comparison = compare_models(shapes, {"none"}, options);
  EXPECT_THAT(comparison.cohort.source.source, HasSubstr("mean of 6 shapes"));
  EXPECT_THAT(comparison.settings.kernel.spec(), testing::Not(HasSubstr("auto")));
  EXPECT_EQ(comparison.models.front().fit.coordinates, 6 * (12 - 4));
  EXPECT_TRUE(comparison.models.front().prediction.has_value());
}

TEST(CompareModels, Refuses) {
  const Landmarks source = line(4);
  const CohortShapes shapes{source, {source}};
  EXPECT_THAT(error_of([&] { compare_models(shapes, {}, quick()); }), HasSubstr("no noise model is named"));
  EXPECT_THAT(error_of([&] { compare_models(shapes, {"ch-ds"}, quick()); }), HasSubstr("ch-ds"));
  EXPECT_THAT(error_of([&] { compare_models({source, {line(5)}}, {"none"}, quick()); }), HasSubstr("4 landmarks"));
}

RecoveryOptions tiny_study() {
  RecoveryOptions options;
  options.settings = cohort_settings();
  options.settings.kernel = "gaussian:alpha=1";
  options.cohorts = 6;
  options.shapes = 12;
  return options;
}

TEST(StudyRecovery, ModelsThatDifferMuchAreToldApart) {
  const Landmarks source = oval(8);
  RecoveryOptions options = tiny_study();
  int last = 0;
  options.on_cohort = [&](int done, int all) {
    EXPECT_EQ(done, ++last);
    EXPECT_EQ(all, 12);
  };
  const std::vector<RecoveryRow> rows =
      study_recovery(source, {{"none", 50}, {"ch-sd:beta=0.15", 50}}, {"none", "ch-sd"}, options);
  ASSERT_EQ(rows.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(std::accumulate(rows[i].chosen.begin(), rows[i].chosen.end(), rows[i].unfit), 6);
    EXPECT_GE(rows[i].chosen[i], 5) << i;
    EXPECT_GT(rows[i].displacement, 0.05);
  }
  EXPECT_EQ(last, 12);
  EXPECT_NEAR(rows[0].noise_share, 0, 1e-12);
  EXPECT_GT(rows[1].noise_share, 0.3);
  EXPECT_LT(rows[1].noise_share, 1);
  // What each candidate made of each cohort: its numbers within their intervals, and no model behind that it nests.
  for (const RecoveryRow& row : rows) {
    ASSERT_EQ(row.fits.size(), 6U);
    for (const std::vector<RecoveredFit>& fits : row.fits) {
      ASSERT_EQ(fits.size(), 2U);
      ASSERT_EQ(fits[0].numbers.size(), 1U);
      ASSERT_EQ(fits[1].numbers.size(), 2U);
      EXPECT_GE(fits[1].log_evidence, fits[0].log_evidence - 0.1);
      for (const RecoveredFit& fit : fits)
        for (const FittedNumber& number : fit.numbers) {
          EXPECT_LE(number.low, number.value) << number.name;
          EXPECT_GE(number.high, number.value) << number.name;
        }
    }
  }
  for (const std::vector<RecoveredFit>& fits : rows[0].fits) {
    const FittedNumber& lambda = fits[0].numbers[0];
    EXPECT_NEAR(std::log(lambda.high / lambda.low), 2 * 1.645 * lambda.log_deviation, 0.15);
  }
  int covered = 0;  // 9 of 10 in the mean; fewer than 3 of 6 once in 800
  for (const std::vector<RecoveredFit>& fits : rows[1].fits)
    if (fits[1].numbers[1].low <= 0.15 && fits[1].numbers[1].high >= 0.15) ++covered;
  EXPECT_GE(covered, 3);
}

// Under the model that shapes are drawn from, the ratio of the evidence of any other to its own has mean 1, if both are
// exact. Draws that miss their data by up to a standard deviation make it 1.13, by up to three 1.8.
TEST(StudyRecovery, RatiosOfEvidencesHaveMeanOne) {
  RecoveryOptions options = tiny_study();
  options.settings.kernel = "gaussian:alpha=0.5";
  options.settings.lambda = 50;
  options.settings.importance_samples = 32;
  options.cohorts = 60;
  options.shapes = 20;
  const RecoveryRow row = study_recovery(oval(12), {{"none", 50}}, {"none", "ch-sd:beta=0.01"}, options).front();
  Eigen::ArrayXd ratios(options.cohorts);
  for (Eigen::Index i = 0; i < ratios.size(); ++i) {
    const std::vector<RecoveredFit>& fits = row.fits[static_cast<std::size_t>(i)];
    ratios[i] = std::exp(fits[1].log_evidence - fits[0].log_evidence);
  }
  const double error = std::sqrt((ratios - ratios.mean()).square().mean() / options.cohorts);
  EXPECT_LE(error, 0.06);
  EXPECT_NEAR(ratios.mean(), 1, 2 * error);
}

TEST(StudyRecovery, Refuses) {
  const Landmarks source = oval(5);
  EXPECT_THAT(error_of([&] {
                study_recovery(source, {{"ch-sd", 1}}, {"none"}, tiny_study());
              }),
              HasSubstr("drawing shapes needs all of them"));
  RecoveryOptions none = tiny_study();
  none.cohorts = 0;
  EXPECT_THAT(error_of([&] { study_recovery(source, {{"none", 1}}, {"none"}, none); }), HasSubstr("0 cohorts"));
}

}  // namespace
}  // namespace pulson::compare
