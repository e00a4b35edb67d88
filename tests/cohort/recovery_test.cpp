// Cohorts drawn from a known template and covariance of momenta.

#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "pulson/cohort/statistics.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;

constexpr int kCohorts = 50, kShapes = 30;

// Two modes, bend and shear, besides weak noise of landmarks: their standard deviations in the metric.
struct TwoModes {
  CohortLaw law;
  std::vector<Points> directions;  // momenta of norm 1
  double deviations[2] = {0.15, 0.05};

  TwoModes() {
    law.sigma = 0.003;
    law.lambda = 100;
    const Eigen::MatrixXd gram = law.kernel.gram(law.q0, law.q0);
    Points bend = 0 * law.q0, shear = 0 * law.q0;
    for (Index a = 0; a < 12; ++a) {
      bend(1, a) = law.q0(0, a) * law.q0(0, a) - 0.5;
      shear(0, a) = law.q0(1, a);
    }
    for (Points velocity : {bend, shear}) {
      Points p = gram.llt().solve(velocity.transpose()).transpose();
      for (const Points& before : directions) p -= (before * gram).cwiseProduct(p).sum() * before;
      directions.push_back(p / std::sqrt((p * gram).cwiseProduct(p).sum()));
    }
  }

  std::vector<Landmarks> draw(std::uint64_t seed) const {
    const Geodesics geodesics(law.kernel, 10);
    std::vector<Landmarks> shapes;
    for (int i = 0; i < kShapes; ++i) {
      const Eigen::MatrixXd z = standard_normals(seed, static_cast<std::uint64_t>(i), 26, 1);
      const Points p = deviations[0] * z(0) * directions[0] + deviations[1] * z(1) * directions[1];
      shapes.push_back(shape_of(geodesics.shoot(law.q0, p).q + law.sigma * Points(z.bottomRows(24).reshaped(2, 12))));
    }
    return shapes;
  }
};

TEST(Recovery, OfTemplateAndModesWithinTheirStandardErrors) {
  const TwoModes truth;
  const Eigen::MatrixXd gram = truth.law.kernel.gram(truth.law.q0, truth.law.q0);
  Points bias = 0 * truth.law.q0;
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(2, 12);
  double first = 0, second = 0, cosine = 0;
  for (std::uint64_t cohort = 0; cohort < kCohorts; ++cohort) {
    const Atlas atlas = make_atlas(truth.draw(1000 + cohort), options_of(truth.law));
    ASSERT_TRUE(atlas.converged);
    const Points error = atlas.template_shape.points - truth.law.q0;
    bias += error / kCohorts;
    squares += error.cwiseAbs2() / kCohorts;
    const ShapeModes modes = momentum_modes(atlas);
    first += modes.eigenvalues[0] / kCohorts;
    second += modes.eigenvalues[1] / kCohorts;
    // In the metric of the true template.
    const Points& found = modes.directions[0];
    const double norm = std::sqrt((found * gram).cwiseProduct(found).sum());
    cosine += std::abs((found * gram).cwiseProduct(truth.directions[0]).sum()) / norm / kCohorts;
  }
  // Each coordinate's mean error over the cohorts, beside its standard error: 24 of them, in two modes.
  const Eigen::MatrixXd standard_errors = (squares / kCohorts).cwiseSqrt();
  EXPECT_LT((bias.array() / standard_errors.array()).abs().maxCoeff(), 4);
  // The error of one cohort: displacements of the modes' standard deviations over √n.
  double variance = 24 * truth.law.sigma * truth.law.sigma;
  for (int k = 0; k < 2; ++k)
    variance += std::pow(truth.deviations[k], 2) * (truth.directions[static_cast<std::size_t>(k)] * gram).squaredNorm();
  EXPECT_NEAR(squares.sum() * kShapes / variance, 1, 4 * std::sqrt(2.0 / kCohorts));
  // Eigenvalues: χ² with n − 1 degrees of freedom, √(2/29/50) = 3.7 % each; 4 of these and what the noise of landmarks
  // and the curvature of the space, a few per cent, add.
  EXPECT_NEAR(first / std::pow(truth.deviations[0], 2), 1, 0.15);
  EXPECT_NEAR(second / std::pow(truth.deviations[1], 2), 1, 0.15);
  // The angle between the first modes: E tan² = μ₁μ₂/(n (μ₁ − μ₂)²) for the second mode alone (T. Anderson 1963).
  const double ratio = std::pow(truth.deviations[0] / truth.deviations[1], 2);
  double square = ratio / (kShapes * std::pow(ratio - 1, 2));
  // The same for the noise of landmarks, of variance σ²k/(k + λσ²)² along the eigenvectors of K.
  const double tau = truth.law.lambda * truth.law.sigma * truth.law.sigma;
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram).eigenvalues();
  for (const double k : values)
    square += 2 * std::pow(truth.law.sigma / (k + tau), 2) * k / (kShapes * std::pow(truth.deviations[0], 2));
  EXPECT_GT(cosine, 1 - square);  // 1 − cos is half of it on average
}

}  // namespace
}  // namespace pulson::cohort
