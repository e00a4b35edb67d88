// The laws of the audit against brute force: marginal and conditional densities, and a shape that is left out.

#include "audit/landmark_law.hpp"

#include <cmath>
#include <random>

#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "audit/cohort_law.hpp"
#include "audit/robust_alignment.hpp"
#include "pulson/core/alignment.hpp"

namespace pulson::audit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Points random_points(int seed, int d, int n) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  return Points::NullaryExpr(d, n, [&] { return normal(random); });
}

VectorXd displacement_of(int seed, const Points& reference) {
  return 0.1 * random_points(seed, static_cast<int>(reference.rows()), static_cast<int>(reference.cols())).reshaped();
}

// In coordinates of the directions that no motion has, P is the inverse of the covariance there.
TEST(LandmarkLaw, IsThatOfTheDirectionsWithoutMotion) {
  for (const int d : {2, 3}) {
    const Points reference = random_points(1, d, 9);
    const MatrixXd directions = directions_of_shape(reference);
    const std::vector<MatrixXd> covariances = kernel_covariances(reference);
    const LandmarkLaw law = pair_law(reference);
    ASSERT_EQ(law.members().size(), covariances.size());
    double constant = 0;
    for (std::size_t k = 0; k < covariances.size(); k += 7) {
      MatrixXd all = MatrixXd::Zero(9 * d, 9 * d);
      for (int a = 0; a < 9; ++a)
        for (int b = 0; b < 9; ++b) all.block(a * d, b * d, d, d).diagonal().setConstant(covariances[k](a, b));
      const MatrixXd inside = directions.transpose() * all * directions;
      const MatrixXd precision = directions * inside.inverse() * directions.transpose();
      EXPECT_LT((law.members()[k].precision - precision).norm(), 1e-9 * precision.norm());
      // ½ log det differs from the members' constant by that of the motions, which all members share
      const double here = law.members()[k].log_constant + 0.5 * std::log(inside.determinant());
      if (k == 0) constant = here;
      EXPECT_NEAR(here, constant, 1e-8);
    }
  }
}

// ∫ p(y) dy_a by the trapezoidal rule over a landmark of the plane.
TEST(LandmarkLaw, IntegratesOutALandmark) {
  const Points reference = random_points(2, 2, 6);
  const LandmarkLaw all(reference, {pair_law(reference).members()[6]}, 8, 5, 0.7);
  LandmarkLaw others = all;
  others.drop(4);
  VectorXd y = displacement_of(3, reference);
  constexpr double kStep = 0.02, kRange = 16;
  double integral = 0;
  for (double u = -kRange; u <= kRange; u += kStep)
    for (double v = -kRange; v <= kRange; v += kStep) {
      VectorXd here = y;
      here[8] += u;
      here[9] += v;
      integral += kStep * kStep * std::exp(all.log_density(here));
    }
  EXPECT_NEAR(std::log(integral), others.log_density(y), 1e-4);
  EXPECT_NEAR(all.log_density_without(4, y), others.log_density(y), 1e-10);
  const auto prediction = all.predict(y)[4];
  EXPECT_NEAR(prediction.log_rest + prediction.log_density, all.log_density(y), 1e-10);
}

TEST(LandmarkLaw, PredictsALandmarkWhereItsDensityIsGreatest) {
  const Points reference = random_points(4, 3, 7);
  const LandmarkLaw law(reference, {pair_law(reference).members()[9]}, 14, 3, 0.4);
  const VectorXd y = displacement_of(5, reference);
  const auto prediction = law.predict(y)[2];
  VectorXd expected = y;
  expected.segment(6, 3) -= prediction.deviation;
  for (int k = 0; k < 3; ++k)
    for (const double step : {-0.01, 0.01}) {
      VectorXd beside = expected;
      beside[6 + k] += step;
      EXPECT_LT(law.log_density(beside), law.log_density(expected));
    }
}

// The covariance after the shape's removal is that of a prior and of all the others about their mean, in the model's
// own numbers; so the left-out law gives any shape's squares as a law that never saw it, but for those fitted numbers.
TEST(CohortLaw, DependsOnAShapeOnlyThroughItsFittedNumbers) {
  const Points mean = random_points(6, 2, 7);
  std::vector<Points> shapes;
  for (int seed = 10; seed < 40; ++seed) shapes.push_back(mean + 0.02 * random_points(seed, 2, 7));
  std::vector<bool> accused(shapes.size(), false);
  const ShapeDirections directions(mean);
  const LandmarkLaw left_out = CohortLaw(shapes, directions, accused).law_without(3);
  accused[3] = true;
  const LandmarkLaw unseen = CohortLaw(shapes, directions, accused).law_without(3);
  EXPECT_LT((left_out.reference() - unseen.reference()).norm(), 2e-3 * unseen.reference().norm());
  const VectorXd y = displacement_of(7, mean);
  const double one = y.dot(left_out.members()[0].precision * y), other = y.dot(unseen.members()[0].precision * y);
  EXPECT_NEAR(one / other, 1, 0.1);
}

TEST(RobustAlignment, IsThatOfTheLandmarksThatFit) {
  for (const int d : {2, 3}) {
    const Points target = random_points(8, d, 10);
    MatrixXd rotation = Eigen::HouseholderQR<MatrixXd>(random_points(9, d, d)).householderQ();
    if (rotation.determinant() < 0) rotation.row(0) *= -1;
    Points shape = 3 * (rotation * target);
    shape.col(1).swap(shape.col(6));
    shape.col(4) *= 40;
    const Points moved = robustly_aligned(shape, target);
    for (const int a : {0, 2, 3, 5, 7, 8, 9}) EXPECT_LT((moved.col(a) - target.col(a)).norm(), 1e-6) << d << " " << a;
  }
}

}  // namespace
}  // namespace pulson::audit
