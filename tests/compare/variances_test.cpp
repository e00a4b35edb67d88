#include "variances.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The definition, by a determinant.
double likelihood(const std::vector<VarianceData>& shapes, const VectorXd& u) {
  double sum = 0;
  for (const VarianceData& shape : shapes) {
    MatrixXd c = shape.fixed;
    VectorXd t = shape.innovation;
    for (Index g = 0; g < u.size(); ++g) {
      c += std::exp(u[g]) * shape.groups[static_cast<std::size_t>(g)];
      t -= std::expm1(u[g]) * shape.drifts[static_cast<std::size_t>(g)];
    }
    const Eigen::FullPivLU<MatrixXd> factors(c);
    sum -= 0.5 * t.dot(factors.solve(t)) + 0.5 * std::log(factors.determinant());
  }
  return sum;
}

// M = I for one group; t of variance v.
std::vector<VarianceData> alike(Index n, int shapes, double v, std::uint64_t seed) {
  std::vector<VarianceData> all;
  for (int s = 0; s < shapes; ++s) {
    const VectorXd t = std::sqrt(v) * standard_normals(seed, static_cast<std::uint64_t>(s), static_cast<int>(n), 1);
    all.push_back({t, MatrixXd::Identity(n, n), {MatrixXd::Identity(n, n)}, {VectorXd::Zero(n)}});
  }
  return all;
}

// C = (1 + v) I: v̂ = mean t² − 1, and Fisher's information of (log v, log σ²) is n/2 (v², v; v, 1)/(1 + v)².
TEST(FitVariances, OfOneGroupIsTheMeanSquareLessOne) {
  constexpr Index kCount = 5;
  constexpr int kShapes = 8;
  const std::vector<VarianceData> shapes = alike(kCount, kShapes, 3, 1);
  double square = 0;
  for (const VarianceData& shape : shapes) square += shape.innovation.squaredNorm() / (kCount * kShapes);
  const VarianceFit fit = fit_variances(shapes, 1);
  const double v = square - 1;
  EXPECT_NEAR(std::exp(fit.u[0]), v, 1e-6 * v);
  EXPECT_GT(fit.u[0], fit.least[0]);
  const double each = 0.5 * kCount * kShapes / std::pow(1 + v, 2);
  Eigen::Matrix2d information;
  information << v * v, v, v, 1;
  EXPECT_LE((fit.information - each * information).norm(), 1e-5 * each);
  EXPECT_NEAR(fit.log_likelihood, likelihood(shapes, fit.u), 1e-9);
}

TEST(FitVariances, AGroupThatIsNotWantedVanishes) {
  const std::vector<VarianceData> shapes = alike(5, 8, 0.5, 2);
  double square = 0;
  for (const VarianceData& shape : shapes) square += shape.innovation.squaredNorm() / 40;
  ASSERT_LT(square, 1);
  const VarianceFit fit = fit_variances(shapes, 1);
  EXPECT_EQ(fit.u[0], fit.least[0]);
  EXPECT_LE(std::exp(fit.u[0]), 1.001e-6);
  EXPECT_NEAR(fit.log_likelihood, likelihood(shapes, VectorXd::Constant(1, -100)), 1e-4);
}

TEST(FitVariances, OfNoGroupIsTheLikelihoodAlone) {
  std::vector<VarianceData> shapes = alike(3, 2, 1, 3);
  for (VarianceData& shape : shapes) shape.groups = {}, shape.drifts = {};
  const VarianceFit fit = fit_variances(shapes, 0);
  EXPECT_EQ(fit.u.size(), 0);
  EXPECT_NEAR(fit.log_likelihood, likelihood(shapes, VectorXd(0)), 1e-12);
}

// Two groups of full and of low rank beside some fixed variance, drawn at u = 0, of shapes that differ.
std::vector<VarianceData> two_groups(double drift, std::uint64_t seed) {
  Numbers numbers(21);
  std::vector<VarianceData> shapes;
  for (std::uint64_t s = 0; s < 30; ++s) {
    const MatrixXd a = numbers(6, 6), b = 2 * numbers(6, 2), c = numbers(6, 1);
    const MatrixXd fixed = MatrixXd::Identity(6, 6) + c * c.transpose();
    const MatrixXd all = fixed + a * a.transpose() + b * b.transpose();
    const VectorXd t = all.llt().matrixL() * standard_normals(seed, s, 6, 1);
    shapes.push_back({t, fixed, {a * a.transpose(), b * b.transpose()}, {VectorXd::Zero(6), drift * numbers(6, 1)}});
  }
  return shapes;
}

class WithDrift : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(All, WithDrift, testing::Values(0.0, 0.5));

TEST_P(WithDrift, NoPlaceAroundIsMoreLikely) {
  const std::vector<VarianceData> shapes = two_groups(GetParam(), 4);
  const VarianceFit fit = fit_variances(shapes, 2);
  EXPECT_NEAR(fit.log_likelihood, likelihood(shapes, fit.u), 1e-9);
  for (int i = -40; i <= 40; ++i)
    for (int j = -40; j <= 40; ++j) {
      const VectorXd u = fit.u + 0.05 * Eigen::Vector2d(i, j);
      ASSERT_LE(likelihood(shapes, u), fit.log_likelihood + 1e-9) << u.transpose();
    }
  for (Index g = 0; g < 2; ++g) {  // the slope, by differences
    const VectorXd step = 1e-4 * VectorXd::Unit(2, g);
    const double slope = (likelihood(shapes, fit.u + step) - likelihood(shapes, fit.u - step)) / 2e-4;
    EXPECT_LE(std::abs(slope), 1e-4 * fit.information(g, g));
  }
}

// The true u = 0 lies within 3.5 deviations of the information in each of some sets.
TEST_P(WithDrift, DeviationsAreThoseOfTheEstimates) {
  constexpr int kSets = 40;
  Eigen::Array2d squares = Eigen::Array2d::Zero();
  for (std::uint64_t seed = 100; seed < 100 + kSets; ++seed) {
    const VarianceFit fit = fit_variances(two_groups(GetParam(), seed), 2);
    const MatrixXd covariance = MatrixXd(fit.information.topLeftCorner(2, 2)).inverse();
    squares += fit.u.array().square() / covariance.diagonal().array() / kSets;
  }
  // The mean of 40 squares of standard normals: 1 ± 3.5 √(2/40).
  EXPECT_LE((squares - 1).abs().maxCoeff(), 3.5 * std::sqrt(2.0 / kSets)) << squares.transpose();
}

// One coordinate with a drift: t − (v − 1) d ~ N(0, 1 + v); information v²/(2(1 + v)²) + v² d²/(1 + v).
TEST(FitVariances, OfOneCoordinateWithDriftIsThatOfAFineGrid) {
  constexpr double kDrift = 0.8;
  std::vector<VarianceData> shapes;
  for (const double t : {-2.0, 0.5, 1.1, 3.0, 2.4})
    shapes.push_back({VectorXd::Constant(1, t),
                      MatrixXd::Identity(1, 1),
                      {MatrixXd::Identity(1, 1)},
                      {VectorXd::Constant(1, kDrift)}});
  double best = -6;
  const auto at = [&](double u) { return likelihood(shapes, VectorXd::Constant(1, u)); };
  for (double u = -6; u < 6; u += 1e-3)
    if (at(u) > at(best)) best = u;
  const VarianceFit fit = fit_variances(shapes, 1);
  EXPECT_NEAR(fit.u[0], best, 1e-3);
  const double v = std::exp(fit.u[0]);
  EXPECT_NEAR(fit.information(0, 0), 5 * (0.5 * v * v / std::pow(1 + v, 2) + v * v * kDrift * kDrift / (1 + v)), 1e-4);
}

}  // namespace
}  // namespace pulson::compare
