// Searches over paths along a line, by sweeps, against dense matrices.

#include "line_system.hpp"

#include <string>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "cometric.hpp"
#include "kernels/line_sums.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMarkers = 70;  // enough for sweeps

// Places that all move on, in random order.
MatrixXd moving_places(Index steps) {
  MatrixXd places(kMarkers, steps);
  for (Index a = 0; a < kMarkers; ++a)
    for (Index k = 0; k < steps; ++k) {
      const double label = static_cast<double>(a * 37 % kMarkers) / 10;
      places(a, k) = label + 0.3 * static_cast<double>(k) * std::sin(label);
    }
  return places;
}

MatrixXd dense_system(const KernelOperator& kernel, const MatrixXd& places, const MatrixXd& weights,
                      const VectorXd& noise) {
  MatrixXd dense = noise.asDiagonal();
  for (Index k = 0; k < places.cols(); ++k) {
    const Points q = places.col(k).transpose();
    dense += weights.col(k).asDiagonal() * kernel.gram(q, q) * weights.col(k).asDiagonal();
  }
  return dense;
}

class LineSystemOf : public testing::TestWithParam<std::string> {
 protected:
  const KernelOperator kernel_ = make_kernel(GetParam() + ":alpha=0.8,weight=1.2");
};

INSTANTIATE_TEST_SUITE_P(Matern, LineSystemOf, testing::Values("peakon", "matern32", "matern52"));

TEST_P(LineSystemOf, SolvesAsTheDenseMatrixWhereTheOrderStays) {
  const MatrixXd places = moving_places(3);
  MatrixXd weights = (places.array().cos() + 2).matrix();
  weights(5, 1) = 0;
  const VectorXd noise = (places.col(0).array().sin() + 1.5).matrix();
  const LineSystem system(kernel_.terms().front(), places, weights, noise);
  EXPECT_EQ(system.movers(), 0);
  const VectorXd right = places.col(2).array().square();
  VectorXd solved = right;
  system.solve_in_place(solved);
  EXPECT_LE((dense_system(kernel_, places, weights, noise) * solved - right).norm(), 1e-11 * right.norm());
}

// A run of nine in reverse order, of which one may stay, and two that change places elsewhere.
TEST_P(LineSystemOf, SolvesAsTheDenseMatrixWhereTheOrderChanges) {
  MatrixXd places = moving_places(3);
  const std::vector<Index> order = sorted_order(places.col(2));
  for (std::size_t i = 0; i < 4; ++i) std::swap(places(order[10 + i], 2), places(order[18 - i], 2));
  std::swap(places(order[40], 1), places(order[41], 1));
  const MatrixXd weights = (places.array().cos() + 2).matrix();
  const VectorXd noise = (places.col(0).array().sin() + 1.5).matrix();
  const LineSystem system(kernel_.terms().front(), places, weights, noise);
  EXPECT_EQ(system.movers(), 9);
  const VectorXd right = places.col(0).array().cos();
  VectorXd solved = right;
  system.solve_in_place(solved);
  EXPECT_LE((dense_system(kernel_, places, weights, noise) * solved - right).norm(), 1e-11 * right.norm());
}

TEST(CometricAlongLine, IsThatOfTheDenseMatrix) {
  const Points q = moving_places(1).transpose();
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=0.3,on=2/5/9");
  const NoiseCometric of_noise = noise_cometric(*noise, q);
  const KernelOperator one = make_kernel("matern32:alpha=0.8");
  const KernelOperator halves = make_kernel("matern32:alpha=0.8,weight=0.5+matern32:alpha=0.8,weight=0.5");
  const Cometric sweeps(one, of_noise, 1.7, q), dense(halves, of_noise, 1.7, q);
  ASSERT_TRUE(sweeps.is_on_line());
  ASSERT_FALSE(dense.is_on_line());
  const Points p = q.array().cos();
  EXPECT_LE((sweeps.apply(p) - dense.apply(p)).norm(), 1e-12 * p.norm());
  EXPECT_LE((dense.apply(sweeps.solve(p)) - p).norm(), 1e-8 * p.norm());
  const MatrixXd psi = (q.array() + 1).transpose();
  MatrixXd sum = MatrixXd::Zero(10, 1), same = sum;
  sweeps.add_transformed(psi, 0.1, 9, sum);
  dense.add_transformed(psi, 0.1, 9, same);
  EXPECT_LE((sum - same).norm(), 1e-12 * same.norm());
}

// The same kernel as a sum of two halves has a dense matrix.
TEST(RegistrationAlongLine, IsThatOfDenseMatrices) {
  Landmarks source, target;
  source.points.resize(1, kMarkers);
  for (Index a = 0; a < kMarkers; ++a)
    source.points(a) = static_cast<double>(a) + 0.3 * std::sin(3.0 * static_cast<double>(a));
  target.points = source.points + 2 * (source.points.array() / 10).sin().matrix();
  std::swap(target.points(20), target.points(22));
  RegistrationOptions options;
  options.noise = "ch-sd:beta=1";
  options.sigma = Length(0.05);
  options.align = AlignmentKind::kNone;
  options.lambda = 1;
  options.grid = {1, 10};
  options.kernel = "matern32:alpha=6";
  const Registration sweeps = register_shapes(source, target, options);
  options.kernel = "matern32:alpha=6,weight=0.5+matern32:alpha=6,weight=0.5";
  const Registration dense = register_shapes(source, target, options);
  EXPECT_TRUE(sweeps.converged);
  EXPECT_TRUE(dense.converged);
  EXPECT_NEAR(sweeps.cost.total(), dense.cost.total(), 1e-8 * dense.cost.total());
  EXPECT_LE((sweeps.momenta - dense.momenta).norm(), 1e-5 * dense.momenta.norm());
  EXPECT_LE((sweeps.result - dense.result).norm(), 1e-7 * dense.result.norm());
}

// Markers much closer than the kernel is wide, a run of which is in reverse order: fields in space are too steep for
// steps there, and the search must still match them.
TEST(RegistrationAlongLine, MatchesARunInReverseOrder) {
  for (const char* kernel : {"matern32:alpha=2", "peakon:alpha=2"}) {
    Landmarks source, target;
    source.points.resize(1, kMarkers);
    for (Index a = 0; a < kMarkers; ++a)
      source.points(a) = static_cast<double>(a) + 0.3 * std::sin(3.0 * static_cast<double>(a));
    target.points = source.points;
    target.points.middleCols(30, 12) = source.points.middleCols(30, 12).rowwise().reverse();
    RegistrationOptions options;
    options.kernel = kernel;
    options.noise = "ch-sd:beta=2%";
    options.align = AlignmentKind::kNone;
    options.grid = {1, 10};
    const Registration found = register_shapes(source, target, options);
    EXPECT_TRUE(found.converged) << kernel;
    // Straight lines by the noise alone are a path, too.
    const double beta = 0.02 * diameter(source.points);
    const double most = (target.points - source.points).squaredNorm() / (2 * beta * beta);
    EXPECT_LT(found.cost.total(), 0.05 * most) << kernel;
    EXPECT_LT(found.rms(), 0.1 * found.sigma) << kernel;
  }
}

}  // namespace
}  // namespace pulson::matching
