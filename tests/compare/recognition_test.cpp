// How often noise would be recognised, beside the same question of two variances.

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {
namespace {

constexpr double kError = 0.01, kOfKernel = 0.36787944117144233;  // e⁻¹, two landmarks a width apart

// Of two landmarks on a line, their sum and difference: variances σ² + (1 ± k)/λ + β².
struct Variances {
  double sum, difference;
};

Variances variances(double of_momenta, double of_noise) {
  return {kError * kError + (1 + kOfKernel) * of_momenta + of_noise,
          kError * kError + (1 - kOfKernel) * of_momenta + of_noise};
}

double log_likelihood(const Variances& model, const Variances& squares, double count) {
  return -0.5 * (squares.sum / model.sum + squares.difference / model.difference +
                 count * (std::log(model.sum) + std::log(model.difference)));
}

// The greatest over 1/λ, and over β² where it is fitted, on a grid of logarithms.
double greatest(const Variances& squares, double count, bool with_noise) {
  double best = -std::numeric_limits<double>::infinity();
  const double least = with_noise ? -12 : 0;
  for (double noise = least; noise <= 0; noise += 0.1)
    for (double momenta = -12; momenta <= 0; momenta += 0.1)
      best = std::max(best,
                      log_likelihood(variances(std::exp(momenta), with_noise ? std::exp(noise) : 0), squares, count));
  return best;
}

Comparison comparison_of(const Variances& drawn, int shapes) {
  Landmarks source;
  source.points = Points{{0, 1}};
  source.source = "pair";
  std::mt19937 random(5);  // NOLINT(cert-msc51-cpp): the same shapes each time
  std::normal_distribution<double> normal;
  CohortShapes cohort;
  cohort.source = source;
  for (int s = 0; s < shapes; ++s) {
    const double sum = std::sqrt(drawn.sum) * normal(random), difference = std::sqrt(drawn.difference) * normal(random);
    Landmarks shape = source;
    shape.points += Points{{sum + difference, sum - difference}} / std::sqrt(2.0);
    cohort.targets.push_back(shape);
  }
  CompareOptions options;
  options.settings.kernel = "gaussian:alpha=1";
  options.settings.sigma = kError;
  options.settings.grid = {1, 5};
  options.settings.upper_ends = false;
  options.settings.importance_samples = 0;
  options.folds = 0;
  options.maps = false;
  return compare_models(cohort, {"none", "ch-sd"}, options);
}

TEST(Recognition, IsThatOfTwoVariances) {
  const int shapes = 60;
  const Comparison comparison = comparison_of(variances(0.002, 0.003), shapes);
  const ComparedModel& none = comparison.models[0];
  const ComparedModel& noise = comparison.models[1];
  ASSERT_TRUE(none.recognition && noise.recognition);
  EXPECT_EQ(none.recognition->noise_share, 0);
  EXPECT_NEAR(noise.recognition->noise_share, noise.fit.noise_share, 0.03);
  EXPECT_GT(none.recognition->part, 0.9);
  double beta = 0;
  for (const FittedNumber& number : noise.fit.fitted)
    if (number.name == "beta") beta = number.value;
  const Variances truth = variances(1 / noise.fit.lambda, beta * beta);
  std::mt19937 random(6);  // NOLINT(cert-msc51-cpp)
  std::chi_squared_distribution<double> squares(shapes);
  constexpr int kCohorts = 300;
  int recognised = 0;
  for (int cohort = 0; cohort < kCohorts; ++cohort) {
    const Variances seen{truth.sum * squares(random), truth.difference * squares(random)};
    const double gain = greatest(seen, shapes, true) - greatest(seen, shapes, false) - 0.5 * std::log(shapes);
    if (gain > 3) ++recognised;
  }
  const double part = static_cast<double>(recognised) / kCohorts;
  EXPECT_GT(part, 0.1);
  EXPECT_LT(part, 0.9) << "so that it is no question of all or none";
  const double error = std::sqrt(part * (1 - part) * (1.0 / kCohorts + 1.0 / noise.recognition->cohorts));
  EXPECT_NEAR(noise.recognition->part, part, 3 * error);
}

// Landmarks that move together more than the kernel has them do show no noise: a third of the variance is asked for.
TEST(Recognition, IsOfAThirdWhereNoNoiseIsFound) {
  const Comparison comparison = comparison_of({0.003, 0.0005}, 12);
  const ComparedModel& noise = comparison.models[1];
  ASSERT_LT(noise.fit.noise_share, 0.1);
  ASSERT_TRUE(noise.recognition);
  EXPECT_NEAR(noise.recognition->noise_share, 1 / 3., 1e-3);
}

}  // namespace
}  // namespace pulson::compare
