#include "pulson/compare/cohort_fit.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "error_of.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using testing::AllOf;
using testing::Ge;
using testing::HasSubstr;
using testing::Le;

constexpr double kLambda = 50;
constexpr int kShapes = 20;

Cohort drawn_from(const std::string& noise, std::uint64_t seed, int shapes = kShapes, int landmarks = 12) {
  return drawn_cohort(oval(landmarks), noise, kLambda, cohort_settings(), shapes, seed);
}

void expect_recovered(const FittedNumber& number, double truth) {
  EXPECT_FALSE(number.vanishes) << number.name;
  ASSERT_GT(number.log_deviation, 0) << number.name;
  EXPECT_LE(std::abs(std::log(number.value / truth)), 3 * number.log_deviation) << number.name << number.value;
  EXPECT_LE(number.log_deviation, 0.3) << number.name;  // 240 displacements or more tell it better than that
}

TEST(FitCohort, FindsTheNumbersThatShapesWereDrawnWith) {
  const CohortFit geodesic = fit_cohort(drawn_from("none", 1), "none", cohort_settings());
  EXPECT_TRUE(geodesic.converged);
  ASSERT_EQ(geodesic.fitted.size(), 1U);
  expect_recovered(geodesic.fitted.front(), kLambda);
  EXPECT_EQ(geodesic.coordinates, kShapes * 24);
  EXPECT_EQ(geodesic.noise_share, 0);
  EXPECT_NEAR(geodesic.score(), geodesic.log_evidence - 0.5 * std::log(kShapes), 1e-9);

  const CohortFit stochastic = fit_cohort(drawn_from("ch-sd:beta=0.05", 2), "ch-sd", cohort_settings());
  EXPECT_TRUE(stochastic.converged);
  expect_recovered(fitted_number(stochastic, "lambda"), kLambda);
  double square = 0;
  for (std::uint64_t seed = 2; seed < 6; ++seed) {
    CohortSettings sampled = cohort_settings();
    sampled.importance_samples = 16;
    const CohortFit fit = fit_cohort(drawn_from("ch-sd:beta=0.05", seed), "ch-sd", sampled);
    const FittedNumber beta = fitted_number(fit, "beta");
    square += std::pow(std::log(beta.value / 0.05) / beta.log_deviation, 2) / 4;
  }
  EXPECT_LE(square, 1 + 3.5 * std::sqrt(2.0 / 4));  // the mean of 4 squares of standard normals
  EXPECT_GT(stochastic.noise_share, 0.05);
}

TEST(FitCohort, FindsThoseOfNoiseInTheMomentaAndOfFields) {
  const CohortFit momenta = fit_cohort(drawn_from("trouve-vialard:sigma=0.2", 3), "trouve-vialard", cohort_settings());
  expect_recovered(fitted_number(momenta, "sigma"), 0.2);
  const std::string fields = "p-sd:fields=cos,wavenumber=2";
  const CohortFit flow = fit_cohort(drawn_from(fields + ",beta=0.1", 4), fields, cohort_settings());
  const FittedNumber beta = fitted_number(flow, "beta");
  EXPECT_LE(std::abs(std::log(beta.value / 0.1)), 3 * beta.log_deviation) << beta.value;
}

// One shape whose noise can explain all that its momenta explain determines only their sum.
TEST(FitCohort, SaysThatOneShapeDoesNotTellNoiseFromMomenta) {
  Points source(2, 5), target(2, 5);
  source << 0, 1, 0, 2, 1, 0, 0, 1, 1, 1;
  target << 0, 1.2, 0, 2.1, 1, 0.2, 0, 1, 0, 1.2;
  const Cohort cohort{named_shape(source), {named_shape(target)}};
  CohortSettings settings = cohort_settings();
  settings.sigma = 0.02;
  const CohortFit geodesic = fit_cohort(cohort, "none", settings);
  EXPECT_NEAR(fitted_number(geodesic, "lambda").log_deviation, std::sqrt(2.0 / 10), 0.01) << "of ten coordinates";
  for (const FittedNumber& number : fit_cohort(cohort, "ch-sd", settings).fitted) {
    EXPECT_FALSE(number.vanishes) << number.name;
    EXPECT_TRUE(std::isnan(number.log_deviation)) << number.name << " ± " << number.log_deviation;
  }
}

// λ → ∞ and β → 0 leave no variance to take a fraction of.
TEST(FitCohort, HasNoShareOfNoiseInShapesThatVaryLessThanSigma) {
  CohortSettings wide = cohort_settings();
  wide.sigma = 0.5;
  const Cohort cohort = drawn_from("none", 3, 4, 6);
  for (const char* noise : {"none", "ch-sd", "trouve-vialard"})
    EXPECT_EQ(fit_cohort(cohort, noise, wide).noise_share, 0) << noise;
}

// λ is held where it is given, so that β alone is fitted.
TEST(FitCohort, HoldsTheEnergyWhereItIsGiven) {
  CohortSettings settings = cohort_settings();
  settings.lambda = kLambda;
  const CohortFit fit = fit_cohort(drawn_from("ch-sd:beta=0.05", 2), "ch-sd", settings);
  EXPECT_EQ(fit.lambda, kLambda);
  ASSERT_EQ(fit.fitted.size(), 1U);
  expect_recovered(fit.fitted.front(), 0.05);
}

// Every model has the geodesic as its limit of no noise.
TEST(FitCohort, NoModelIsBehindTheGeodesicThatItNests) {
  for (const char* truth : {"none", "ch-sd:beta=0.03"}) {
    const Cohort cohort = drawn_from(truth, 5, 10);
    const double least = fit_cohort(cohort, "none", cohort_settings()).log_evidence;
    for (const char* noise : {"ch-sd", "trouve-vialard", "p-sd:fields=grid,count=2", "p-sd:fields=cos,wavenumber=2"}) {
      const CohortFit fit = fit_cohort(cohort, noise, cohort_settings());
      EXPECT_GE(fit.log_evidence, least) << truth << ' ' << noise;
    }
  }
}

// Where noise does not improve the fit of the geodesic, it is that fit, although both are sampled by other numbers.
TEST(FitCohort, OfANoiseThatVanishesIsThatOfTheGeodesic) {
  const Cohort cohort = drawn_from("none", 11, 6, 6);
  CohortSettings settings = cohort_settings();
  settings.importance_samples = 16;
  settings.fit_width = true;
  const CohortFit none = fit_cohort(cohort, "none", settings);
  const CohortFit fit = fit_cohort(cohort, "trouve-vialard", settings, &none);
  EXPECT_TRUE(fitted_number(fit, "sigma").vanishes) << fitted_number(fit, "sigma").value;
  EXPECT_GT(fitted_number(fit, "sigma").high, 0);
  EXPECT_EQ(fit.log_evidence, none.log_evidence);
  EXPECT_EQ(fit.lambda, none.lambda);
  EXPECT_EQ(fit.kernel, none.kernel);
  EXPECT_EQ(fit.noise_share, 0);
  EXPECT_EQ(fit.shapes.front().increments.rows(), 12);
  EXPECT_EQ(fit_cohort(cohort, "trouve-vialard", settings).log_evidence, fit.log_evidence);
}

// σ²/w is the variance of a landmark's error: weights of 4 are half of σ, and one of 0 is a landmark that is missing.
TEST(FitCohort, TakesTheWeightsOfLandmarks) {
  Cohort cohort = drawn_from("none", 4, 5, 8);
  CohortSettings settings = cohort_settings();
  settings.sigma = 0.02;
  const CohortFit fit = fit_cohort(cohort, "none", cohort_settings());
  cohort.weights.assign(5, Eigen::VectorXd::Constant(8, 4));
  EXPECT_NEAR(fit_cohort(cohort, "none", settings).log_evidence, fit.log_evidence, 1e-6);
  cohort.weights.assign(5, Eigen::VectorXd::Ones(8));
  cohort.weights[2][3] = 0;
  const double weighted = fit_cohort(cohort, "none", settings).log_evidence;
  cohort.weights.clear();
  EXPECT_GT(std::abs(fit_cohort(cohort, "none", settings).log_evidence - weighted), 0.1);
  cohort.targets[2].points.col(3).setConstant(std::nan(""));
  EXPECT_NEAR(fit_cohort(cohort, "none", settings).log_evidence, weighted, 1e-6);
}

// The upper end is where Laplace's evidence of a fit with that much noise is 0.82 nats below its greatest, or where the
// noise's share is at most a tenth beyond; that of samples falls more slowly. The share is that of β² beside 1/λ. With
// 40 shapes it is a small part of the range, which is cut until the share is known.
TEST(FitCohort, SaysHowMuchNoiseIsNotExcluded) {
  CohortSettings settings = cohort_settings();
  settings.lambda = kLambda;
  for (const auto& [samples, shapes] : {std::pair{0, 10}, {64, 10}, {0, 40}}) {
    settings.importance_samples = samples;
    const Cohort cohort = drawn_from("none", 17, shapes);
    const CohortFit fit = fit_cohort(cohort, "ch-sd", settings);
    const double ratio = fit.greatest_noise_share / (1 - fit.greatest_noise_share);
    const std::string spec = "ch-sd:beta=" + std::to_string(std::sqrt(ratio / kLambda));
    const CohortFit there = fit_cohort(cohort, spec, settings);
    EXPECT_NEAR(there.noise_share / fit.greatest_noise_share, 1, 0.1) << samples << ", " << shapes;
    const double drop = fit_cohort(cohort, "none", settings).log_evidence - there.log_evidence;
    EXPECT_NEAR(drop, 0.9, samples == 0 ? 0.2 : 0.8) << samples << ", " << shapes;
    EXPECT_EQ(fit_cohort(cohort, "none", settings).greatest_noise_share, 0);
  }
}

// Six landmarks, of which a geodesic with a narrow kernel moves each by itself: noise that a fit with it allows is not
// excluded, though its kernel is far from that of the fit without.
TEST(FitCohort, UpperEndsAreNoLowerThanNoiseThatAFitAllows) {
  CohortSettings settings = cohort_settings();
  settings.importance_samples = 0;
  settings.fit_width = true;
  int allowed = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const Cohort cohort = drawn_cohort(oval(6), "trouve-vialard:sigma=0.3", kLambda, settings, 10, seed);
    const CohortFit fit = fit_cohort(cohort, "trouve-vialard", settings);
    const CohortFit with = fit_cohort(cohort, "trouve-vialard:sigma=0.3", settings);
    if (with.log_evidence < fit.log_evidence - 0.4) continue;  // of 0.82; linear models miss up to 0.3
    ++allowed;
    EXPECT_GE(fit.greatest_noise_share, 0.95 * with.noise_share) << seed;
  }
  EXPECT_GE(allowed, 3);
}

// Constant noise on each landmark acts on the ends as the error of digitising does: together they are one number.
TEST(FitCohort, DoesNotTellIndependentNoiseFromAFittedError) {
  CohortSettings settings = cohort_settings();
  settings.fit_sigma = true;
  const CohortFit fit = fit_cohort(drawn_from("ch-sd:beta=0.05", 3, 20), "ch-sd", settings);
  EXPECT_TRUE(fit.converged);
  EXPECT_GT(fitted_number(fit, "beta").correlation_with_sigma, 0.9);
  const double both = std::hypot(fit.sigma, fitted_number(fit, "beta").vanishes ? 0 : fitted_number(fit, "beta").value);
  EXPECT_NEAR(std::log(both / std::hypot(0.05, settings.sigma.in(1))), 0, 0.2);
  // What either is alone the evidence bounds from above.
  const FittedNumber beta = fitted_number(fit, "beta"), sigma = fitted_number(fit, "data-sigma");
  EXPECT_LE(beta.low, 0.05);
  EXPECT_THAT(beta.high, AllOf(Ge(0.05), Le(2 * both)));
  EXPECT_THAT(sigma.high, AllOf(Ge(settings.sigma.in(1)), Le(2 * both)));
}

// Of 40 shapes, the numbers of a part of them lead to those of all.
TEST(FitCohort, OfManyShapesIsTheMostLikely) {
  const Cohort cohort = drawn_from("ch-sd:beta=0.1", 8, 40, 8);
  CohortSettings settings = cohort_settings();
  const CohortFit fit = fit_cohort(cohort, "ch-sd", settings);
  EXPECT_TRUE(fit.converged);
  const FittedNumber lambda = fitted_number(fit, "lambda");
  const FittedNumber beta = fitted_number(fit, "beta");
  expect_recovered(lambda, kLambda);
  expect_recovered(beta, 0.1);
  const auto evidence = [&](double of_lambda, double of_beta) {
    settings.lambda = lambda.value * of_lambda;
    return fit_cohort(cohort, "ch-sd:beta=" + std::to_string(beta.value * of_beta), settings).log_evidence;
  };
  for (const auto& [of_lambda, of_beta] : {std::pair{0.8, 1.0}, {1.25, 1.0}, {1.0, 0.8}, {1.0, 1.25}})
    EXPECT_LT(evidence(of_lambda, of_beta), fit.log_evidence - 0.1) << of_lambda << ' ' << of_beta;
}

// At the edge β = 0 the greatest likelihood lies in half of all cohorts; beyond it, twice the gain is χ² of one degree.
TEST(FitCohort, GeodesicShapesWantNoNoise) {
  constexpr int kCohorts = 8;
  int vanished = 0;
  for (std::uint64_t seed = 10; seed < 10 + kCohorts; ++seed) {
    const Cohort cohort = drawn_from("none", seed, 10);
    const CohortFit with = fit_cohort(cohort, "ch-sd", cohort_settings());
    const FittedNumber beta = fitted_number(with, "beta");
    vanished += beta.vanishes ? 1 : 0;
    EXPECT_TRUE(!beta.vanishes || std::isnan(beta.log_deviation));
    // Of χ² of one degree, 1e-4 lies above 15.
    EXPECT_LE(with.log_evidence - fit_cohort(cohort, "none", cohort_settings()).log_evidence, 7.5) << beta.value;
  }
  EXPECT_GE(vanished, 1);  // none of 8: once in 256
}

TEST(FitCohort, FindsTheWidthOfTheKernel) {
  CohortSettings settings = cohort_settings();
  settings.kernel = "gaussian:alpha=0.8";  // the shapes are drawn with 0.5
  settings.fit_width = true;
  const CohortFit fit = fit_cohort(drawn_from("none", 7), "none", settings);
  const FittedNumber width = fitted_number(fit, "alpha");
  expect_recovered(width, 0.5);
  EXPECT_LT(width.low, width.value);
  EXPECT_GT(width.high, width.value);
  settings.fit_width = false;
  EXPECT_GT(fit.log_evidence, fit_cohort(drawn_from("none", 7), "none", settings).log_evidence + 10);
}

TEST(FitCohort, TakesEnoughStepsForTheErrorOfTheEnds) {
  const Cohort cohort = drawn_from("none", 7, 4);
  CohortSettings settings = cohort_settings();
  const int steps = sufficient_steps(cohort, settings);
  EXPECT_GE(steps, 5);
  EXPECT_LE(steps, 80);
  settings.sigma = 1e-4;  // a hundredth: a tenth of the step where the scheme is of second order
  EXPECT_GT(sufficient_steps(cohort, settings), steps);
}

TEST(FitCohort, BitsAreTheSameForAnyNumberOfThreads) {
  const Cohort cohort = drawn_from("ch-sd:beta=0.05", 6, 6);
  CohortSettings settings = cohort_settings();
  settings.importance_samples = 20;
  std::vector<CohortFit> fits;
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    fits.push_back(fit_cohort(cohort, "ch-sd", settings));
  }
  set_thread_count(0);
  EXPECT_EQ(fits[0].log_evidence, fits[1].log_evidence);
  EXPECT_EQ(fits[0].lambda, fits[1].lambda);
  EXPECT_EQ(fits[0].noise, fits[1].noise);
  for (std::size_t s = 0; s < 6; ++s) {
    EXPECT_EQ(fits[0].shapes[s].momenta, fits[1].shapes[s].momenta);
    EXPECT_EQ(fits[0].shapes[s].increments, fits[1].shapes[s].increments);
    EXPECT_EQ(fits[0].shapes[s].log_evidence, fits[1].shapes[s].log_evidence);
  }
}

TEST(FitCohort, LandmarksThatAreMissingTellNothing) {
  Cohort cohort = drawn_from("ch-sd:beta=0.05", 2);
  cohort.targets[0].points.col(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  cohort.targets[4].points(1, 0) = std::numeric_limits<double>::quiet_NaN();
  const CohortFit fit = fit_cohort(cohort, "ch-sd", cohort_settings());
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.coordinates, kShapes * 24 - 3);
  EXPECT_EQ(fit.shapes[0].coordinates, 22);
  expect_recovered(fitted_number(fit, "beta"), 0.05);
  EXPECT_TRUE(fit.shapes[0].end.allFinite());
}

TEST(FitCohort, RefusesNoiseThatTheAlignmentTakesOut) {
  const Landmarks source = oval(6);
  const Cohort cohort = make_cohort(source, drawn_from("none", 7, 4, 6).targets, AlignmentKind::kTranslation);
  EXPECT_THAT(error_of([&] { fit_cohort(cohort, "p-sd:fields=constant", cohort_settings()); }),
              AllOf(HasSubstr("p-sd"), HasSubstr("as their alignment (translation) does, which removes it")));
}

TEST(FitCohort, RefusesWhatIsNoModelOfTheseShapes) {
  const Cohort cohort = drawn_from("none", 8, 2, 4);
  const auto refused = [&](const std::string& noise, double sigma) {
    CohortSettings settings = cohort_settings();
    settings.sigma = sigma;
    return error_of([&] { fit_cohort(cohort, noise, settings); });
  };
  EXPECT_THAT(refused("ch-ds", 0.01), HasSubstr("ch-sd"));
  EXPECT_THAT(refused("ch-sd:on=9", 0.01), HasSubstr("9"));
  EXPECT_THAT(refused("none", 0), HasSubstr("sigma is 0"));
  EXPECT_THAT(refused("none", -1), HasSubstr("sigma is -1"));
  EXPECT_THAT(refused("none", std::numeric_limits<double>::infinity()), HasSubstr("finite"));
}

TEST(FitCohort, FitsNumbersThatAreNoAmplitudes) {
  const Landmarks source = oval(5);
  const Cohort cohort = drawn_cohort(source, "ch-sd-screened:beta=0.1,gamma=1", kLambda, cohort_settings(), 4, 9);
  const CohortFit fit = fit_cohort(cohort, "ch-sd-screened", cohort_settings());
  ASSERT_EQ(fit.fitted.size(), 3U);
  const FittedNumber gamma = fitted_number(fit, "gamma");
  EXPECT_TRUE(std::isfinite(gamma.value));
  EXPECT_GT(gamma.value, 0);
  // No worse than with the number that the shapes were drawn with.
  const CohortFit held = fit_cohort(cohort, "ch-sd-screened:gamma=1", cohort_settings());
  EXPECT_EQ(held.fitted.size(), 2U);
  EXPECT_GE(fit.log_evidence, held.log_evidence - 0.05);
}

// Lengths in another unit: densities of n coordinates change by the nth power, and nothing else does, but for a match
// that ends a step earlier by rounding.
TEST(FitCohort, DoesNotDependOnTheUnit) {
  const Cohort cohort = drawn_from("ch-sd:beta=0.05", 2, 10);
  for (const double factor : {0.0625, 1048576.0}) {
    Cohort other_unit = cohort;
    other_unit.source.points *= factor;
    for (Landmarks& target : other_unit.targets) target.points *= factor;
    CohortSettings settings = cohort_settings();
    settings.sigma = settings.sigma.in(0) * factor;
    settings.kernel = "gaussian:alpha=" + std::to_string(0.5 * factor);
    for (const char* noise : {"none", "ch-sd", "trouve-vialard"}) {
      const CohortFit fit = fit_cohort(cohort, noise, cohort_settings());
      const CohortFit other = fit_cohort(other_unit, noise, settings);
      EXPECT_NEAR(other.log_evidence, fit.log_evidence - fit.coordinates * std::log(factor), 5e-3) << noise;
      EXPECT_NEAR(other.lambda * factor * factor / fit.lambda, 1, 1e-4) << noise;
    }
  }
}

// Where K is nearly singular, momenta in its rough directions are huge, and no time step follows them: they are left
// out.
TEST(FitCohort, OfLandmarksThatAreDenseBesideTheKernel) {
  const Landmarks source = oval(30);
  CohortSettings settings = cohort_settings();
  settings.kernel = "gaussian:alpha=1";
  const Cohort cohort = drawn_cohort(source, "none", 2000, settings, 6, 11);
  for (const char* noise : {"none", "ch-sd"}) {
    const CohortFit fit = fit_cohort(cohort, noise, settings);
    EXPECT_TRUE(fit.converged);
    EXPECT_LE(std::abs(std::log(fit.lambda / 2000)), 3 * fitted_number(fit, "lambda").log_deviation) << noise;
  }
}

// Two cohorts without noise, in which an earlier search found some: in the second β seemed to be two σ.
TEST(FitCohort, NoiseVanishesWhereTheSamplesEvidenceIsGreaterWithoutIt) {
  CohortSettings settings = cohort_settings();
  settings.importance_samples = 16;
  settings.fit_width = true;
  for (const std::uint64_t seed : {1, 14}) {
    const CohortFit fit = fit_cohort(drawn_cohort(oval(8), "none", 50, settings, 12, seed), "ch-sd", settings);
    EXPECT_TRUE(fit.converged) << seed;
    EXPECT_TRUE(fitted_number(fit, "beta").vanishes) << seed << ' ' << fitted_number(fit, "beta").value;
    for (const char* name : {"lambda", "alpha"}) {
      const FittedNumber number = fitted_number(fit, name);
      EXPECT_LT(number.low, number.value) << seed << name;
      EXPECT_GT(number.high, number.value) << seed << name;
      EXPECT_GT(number.high / number.low, 1.3) << seed << name;  // of 96 coordinates, of which some determine it
    }
  }
}

}  // namespace
}  // namespace pulson::compare
