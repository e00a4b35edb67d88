#include "cohort/displacement_fit.hpp"

#include <gtest/gtest.h>

#include "atlas_examples.hpp"

namespace pulson {
namespace {

// Draws of the linear model itself: N(0, K/λ + σ²) on each axis.
std::vector<Points> linear_draws(const CohortLaw& law, int count, std::uint64_t seed) {
  const auto n = law.q0.cols(), d = law.q0.rows();
  Eigen::MatrixXd v = law.kernel.gram(law.q0, law.q0) / law.lambda;
  v.diagonal().array() += law.sigma * law.sigma;
  const Eigen::LLT<Eigen::MatrixXd> factors(v);
  std::vector<Points> shapes;
  for (int i = 0; i < count; ++i) {
    const Points z = standard_normals(seed, static_cast<std::uint64_t>(i), static_cast<int>(d * n), 1).reshaped(d, n);
    shapes.emplace_back(law.q0 + (factors.matrixL() * z.transpose()).transpose());
  }
  return shapes;
}

TEST(DisplacementFit, RecoversWidthLambdaAndSigma) {
  CohortLaw law;
  law.kernel = make_kernel("matern32:alpha=0.4");  // a fifth of the diameter
  const CohortDisplacements found = fit_cohort_displacements(linear_draws(law, 400, 3), {});
  // 400 × 24 numbers: standard errors of about 1.5 % for variances that are distinguished well, a few times as much
  // for those that are not.
  EXPECT_NEAR(found.kernel.terms().front().alpha, 0.4, 0.04);
  EXPECT_NEAR(found.lambda / law.lambda, 1, 0.1);
  EXPECT_NEAR(found.sigma / law.sigma, 1, 0.1);
}

TEST(DisplacementFit, WhatIsGivenIsKept) {
  const CohortLaw law;
  const std::vector<Points> shapes = linear_draws(law, 30, 4);
  CohortFitOptions options;
  options.kernel = law.kernel;
  options.sigma = 0.01;
  const CohortDisplacements found = fit_cohort_displacements(shapes, options);
  EXPECT_EQ(found.sigma, 0.01);
  EXPECT_EQ(found.kernel.spec(), law.kernel.spec());
  EXPECT_NEAR(found.lambda / law.lambda, 1, 4 * std::sqrt(2.0 / (29 * 24)));
  options.lambda = found.lambda;
  options.sigma.reset();
  EXPECT_NEAR(fit_cohort_displacements(shapes, options).sigma, 0.01, 0.002);
  options.sigma = 0;
  options.lambda.reset();
  const CohortDisplacements exact = fit_cohort_displacements(shapes, options);
  EXPECT_EQ(exact.sigma, 0);
  EXPECT_LT(exact.lambda, found.lambda);  // K has to explain the noise too
}

// The likelihood written out in full: of contrasts, whose covariance is AᵀVA.
TEST(DisplacementFit, IsTheLikelihoodOfContrasts) {
  const CohortLaw law;
  std::vector<Points> shapes = linear_draws(law, 5, 5);
  const auto log_likelihood = [&](double lambda, double sigma) {
    Points mean = 0 * law.q0;
    for (const Points& shape : shapes) mean += shape / 5.0;
    std::vector<Eigen::Index> places(24);
    for (Eigen::Index i = 0; i < 24; ++i) places[static_cast<std::size_t>(i)] = i;
    const Eigen::MatrixXd z = motion_directions(mean, AlignmentKind::kSimilarity, places);
    const Eigen::MatrixXd basis =
        Eigen::MatrixXd(Eigen::HouseholderQR<Eigen::MatrixXd>(z).householderQ()).rightCols(24 - z.cols());
    const Eigen::MatrixXd gram = law.kernel.gram(mean, mean);
    Eigen::MatrixXd v = Eigen::MatrixXd::Zero(24, 24);
    for (int a = 0; a < 12; ++a)
      for (int b = 0; b < 12; ++b)
        for (int axis = 0; axis < 2; ++axis)
          v(2 * a + axis, 2 * b + axis) = gram(a, b) / lambda + (a == b ? sigma * sigma : 0);
    const Eigen::LLT<Eigen::MatrixXd> factors(basis.transpose() * v * basis);
    double value = -0.5 * 4 * 2 * factors.matrixLLT().diagonal().array().log().sum();
    for (const Points& shape : shapes) {
      const Eigen::VectorXd r = basis.transpose() * (shape - mean).reshaped();
      value -= 0.5 * r.dot(factors.solve(r));
    }
    return value;
  };
  const auto value = [&](double lambda, double sigma) {
    return fit_cohort_displacements(shapes, {law.kernel, lambda, sigma, AlignmentKind::kSimilarity}).log_likelihood;
  };
  EXPECT_NEAR(value(400, 0.01) - value(200, 0.02), log_likelihood(400, 0.01) - log_likelihood(200, 0.02), 1e-8);
}

}  // namespace
}  // namespace pulson
