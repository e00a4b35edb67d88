#include "cohort/displacement_fit.hpp"

#include <gtest/gtest.h>

#include "atlas_examples.hpp"

namespace pulson::cohort {
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

// A spacing of half the kernel's width, which distinguishes its variance from noise.
CohortLaw dense_law() {
  CohortLaw law;
  law.q0 = oval(30);
  law.kernel = make_kernel("matern32:alpha=0.4");  // a fifth of the diameter
  return law;
}

// Means of logarithms over 20 cohorts, beside their standard errors.
TEST(DisplacementFit, RecoversWidthLambdaAndSigma) {
  const CohortLaw law = dense_law();
  constexpr int kCohorts = 20;
  Eigen::MatrixXd logs(3, kCohorts);
  for (int cohort = 0; cohort < kCohorts; ++cohort) {
    const CohortDisplacements found =
        fit_cohort_displacements(linear_draws(law, 40, 300 + static_cast<std::uint64_t>(cohort)), {}, {});
    logs.col(cohort) << std::log(found.kernel.terms().front().alpha / 0.4), std::log(found.lambda / law.lambda),
        std::log(found.sigma / law.sigma);
  }
  const Eigen::VectorXd mean = logs.rowwise().mean();
  const Eigen::VectorXd deviation = ((logs.colwise() - mean).rowwise().squaredNorm() / (kCohorts - 1)).cwiseSqrt();
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(std::abs(mean[k]), 4 * deviation[k] / std::sqrt(1.0 * kCohorts)) << k;
    EXPECT_LT(deviation[k], 0.2) << k;  // so that this says something
  }
}

TEST(DisplacementFit, WhatIsGivenIsKept) {
  const CohortLaw law = dense_law();
  const std::vector<Points> shapes = linear_draws(law, 30, 4);
  CohortFitOptions options;
  options.kernel = law.kernel;
  options.sigma = 0.01;
  const CohortDisplacements found = fit_cohort_displacements(shapes, {}, options);
  EXPECT_EQ(found.sigma, 0.01);
  EXPECT_EQ(found.kernel.spec(), law.kernel.spec());
  EXPECT_NEAR(found.lambda / law.lambda, 1, 4 * std::sqrt(2.0 / (29 * 60)));
  options.lambda = found.lambda;
  options.sigma.reset();
  // About half of the 29 × 60 numbers show mostly σ: 2.4 % is its standard error.
  EXPECT_NEAR(fit_cohort_displacements(shapes, {}, options).sigma, 0.01, 4 * 0.01 / std::sqrt(29.0 * 60));
  options.sigma = 0;
  options.lambda.reset();
  const CohortDisplacements exact = fit_cohort_displacements(shapes, {}, options);
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
    return fit_cohort_displacements(shapes, {}, {law.kernel, lambda, sigma, AlignmentKind::kSimilarity}).log_likelihood;
  };
  EXPECT_NEAR(value(400, 0.01) - value(200, 0.02), log_likelihood(400, 0.01) - log_likelihood(200, 0.02), 1e-8);
}

// Without an alignment and with the mean of the shapes: −½ Σ_i r_iᵀV⁻¹r_i becomes −½ tr V⁻¹(S + U).
TEST(DisplacementFit, CovariancesOfExpectedPositionsCountAsScatter) {
  const CohortLaw law;
  const std::vector<Points> shapes = linear_draws(law, 5, 6);
  const Eigen::MatrixXd root = standard_normals(9, 0, 24, 24) / 100, uncertain = root * root.transpose();
  Points mean = 0 * law.q0;
  for (const Points& shape : shapes) mean += shape / 5.0;
  const auto gain = [&](double lambda) {
    const CohortFitOptions options{law.kernel, lambda, 0.01};
    return fit_cohort_displacements(shapes, uncertain, options).log_likelihood -
           fit_cohort_displacements(shapes, {}, options).log_likelihood;
  };
  for (const double lambda : {400.0, 100.0}) {
    const Eigen::MatrixXd v = displacement_covariance(law.kernel, lambda, 0.01, mean);
    EXPECT_NEAR(gain(lambda), -0.5 * v.llt().solve(uncertain).trace(), 1e-8 * std::abs(gain(lambda)));
  }
}

}  // namespace
}  // namespace pulson::cohort
