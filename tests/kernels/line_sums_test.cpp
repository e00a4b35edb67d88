// Sums and solutions along a line against loops over all pairs and dense matrices.

#include "line_sums.hpp"

#include <Eigen/Cholesky>

#include "line_covariance.hpp"
#include "line_steps.hpp"
#include "pair_loops.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kCount = 150;  // sums of so many are taken along the line

// Kernels that have such sums.
std::vector<DefinedKernel> line_kernels() {
  std::vector<DefinedKernel> kernels;
  for (const DefinedKernel& kernel : every_kernel())
    if (has_line_sums(kernel.make().terms())) kernels.push_back(kernel);
  return kernels;
}

// Random places on a line: two in one place, two next to each other, one far away.
Points places(int count, unsigned seed) {
  Points q = 3 * random_points(1, count, seed);
  q(4) = q(9);
  q(11) = q(2) + 1e-9;
  q(7) = 1e5;
  return q;
}

class LineSumsOf : public testing::TestWithParam<DefinedKernel> {
 protected:
  const KernelOperator kernel_ = GetParam().make();
};

INSTANTIATE_TEST_SUITE_P(Table, LineSumsOf, testing::ValuesIn(line_kernels()),
                         [](const auto& instance) { return test_name(instance.param.spec()); });

TEST_P(LineSumsOf, FieldsAreSumsOverAllSources) {
  Points x = places(kCount - 50, 1);
  const Points y = places(kCount, 2);
  x(3) = y(8);
  expect_field_sums(GetParam(), kernel_, x, y, random_points(1, kCount, 3));
}

TEST_P(LineSumsOf, SumsOfOnePointSetAreThoseOfAllPairs) {
  expect_self_sums(GetParam(), kernel_, places(kCount, 1), random_points(1, kCount, 2), random_points(1, kCount, 3),
                   random_points(1, kCount, 4));
}

TEST(LineSums, AreNotOfAGaussian) {
  EXPECT_FALSE(has_line_sums(make_kernel("gaussian:alpha=1+peakon:alpha=1").terms()));
  EXPECT_TRUE(has_line_sums(make_kernel("matern52:alpha=1+peakon:alpha=1").terms()));
}

class LineCovarianceOf : public testing::TestWithParam<std::string> {
 protected:
  void expect_dense(double smallest_noise, double accuracy) const {
    const Points q = places(kCount, 5);
    const KernelOperator kernel = make_kernel(GetParam() + ":alpha=1.3,weight=0.7");
    const VectorXd noise =
        smallest_noise * (VectorXd::Ones(kCount) + random_points(1, kCount, 6).cwiseAbs().transpose());
    MatrixXd dense = kernel.gram(q, q);
    dense.diagonal() += noise;
    const Eigen::LLT<MatrixXd> factors(dense);
    const LineCovariance along(kernel.terms().front(), q.transpose(), noise);
    ASSERT_TRUE(along.is_regular());
    const MatrixXd right = random_points(2, kCount, 7).transpose();
    MatrixXd solved = right;
    along.solve_in_place(solved);
    EXPECT_LE((dense * solved - right).norm(), accuracy * right.norm());
    const double log_determinant = 2 * MatrixXd(factors.matrixL()).diagonal().array().log().sum();
    EXPECT_NEAR(along.log_determinant(), log_determinant, accuracy * std::abs(log_determinant));
  }
};

INSTANTIATE_TEST_SUITE_P(Matern, LineCovarianceOf, testing::Values("peakon", "matern32", "matern52"));

TEST_P(LineCovarianceOf, SolvesAsTheDenseMatrix) { expect_dense(0.1, 1e-12); }

// The condition is 1e6 times the number of places: the dense matrix itself leaves 1e-10 of residuals.
TEST_P(LineCovarianceOf, SolvesWhereTheNoiseIsSmall) { expect_dense(1e-6, 1e-9); }

TEST(LineCovariance, OfOnePlaceTwiceWithoutNoiseIsSingular) {
  const VectorXd place = VectorXd::Zero(2);
  EXPECT_FALSE(LineCovariance({KernelProfile::kMatern32, 1, 1}, place, place).is_regular());
}

// Eleven steps, more than are swept abreast, each with its own order and with landmarks at one place.
TEST_P(LineCovarianceOf, StepsAbreastGiveWhatEachGivesByItself) {
  constexpr int kSteps = 11;
  const std::vector<KernelTerm> terms = make_kernel(GetParam() + ":alpha=1.3,weight=0.7").terms();
  const VectorXd noise = 0.1 * (VectorXd::Ones(kCount) + random_points(1, kCount, 6).cwiseAbs().transpose());
  std::vector<LineCovariance> each;
  std::vector<const LineCovariance*> steps;
  std::vector<Points> x, w;
  for (unsigned k = 0; k < kSteps; ++k) {
    x.push_back(places(kCount, 20 + k));
    x.back()(30) = x.back()(31) = x.back()(29);
    w.push_back(random_points(1, kCount, 40 + k));
    each.emplace_back(terms.front(), x.back().transpose(), noise);
  }
  for (const LineCovariance& step : each) steps.push_back(&step);
  const LineSteps abreast(terms.front(), steps);
  const auto [slopes, seconds] = abreast.slope_and_second(w);
  const std::vector<Points> values = abreast.value(w), solved = abreast.solve(w), only_slopes = abreast.slope(w);
  for (std::size_t k = 0; k < kSteps; ++k) {
    const VectorXd at = x[k].transpose();
    const LineSums sums = line_sums(terms, at, at, w[k].transpose());
    EXPECT_LE((values[k].transpose() - sums.value).norm(), 1e-13 * sums.value.norm());
    EXPECT_LE((slopes[k].transpose() - sums.slope).norm(), 1e-13 * sums.slope.norm());
    EXPECT_EQ(only_slopes[k], slopes[k]);
    EXPECT_LE((seconds[k].transpose() - sums.second).norm(), 1e-13 * sums.second.norm());
    MatrixXd alone = w[k].transpose();
    each[k].solve_in_place(alone);
    EXPECT_LE((solved[k].transpose() - alone).norm(), 1e-12 * alone.norm());
  }
}

}  // namespace
}  // namespace pulson
