// Searches over paths along a line, by sweeps, against dense matrices.

#include "line_system.hpp"

#include <string>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "cometric.hpp"
#include "kernels/line_sums.hpp"
#include "path_examples.hpp"
#include "path_model.hpp"
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

// The second derivatives of the cost by sweeps over all steps, and of the same kernel as a sum of two halves by pairs;
// and without noise, so that both models have the same fields, what they solve.
TEST(PathModelAlongLine, IsThatOfPairs) {
  for (const char* kernel : {"peakon:alpha=0.8", "matern32:alpha=0.8", "matern52:alpha=0.8"}) {
    for (const char* noise : {"none", "ch-sd:beta=0.3", "ch-sd-screened:beta=0.3,gamma=0.8"}) {
      constexpr int kNodes = 9;
      PathMatch match{moving_places(1).transpose(), {}, kernel, noise, {1, kNodes}, 0.1, 1.3};
      std::vector<Points> nodes{match.source};
      for (int k = 1; k <= kNodes; ++k)
        nodes.emplace_back(match.source.array() + 0.02 * k * match.source.array().cos());
      match.target = nodes.back();
      PathMatch halved = match;
      halved.kernel = std::string(kernel) + ",weight=0.5+" + kernel + ",weight=0.5";
      PathDirection direction;
      for (int k = 0; k <= kNodes; ++k)
        direction.nodes.emplace_back(0.1 * k * (match.source.array() * (1 + 0.1 * k)).sin());
      for (int k = 0; k < kNodes; ++k) direction.momenta.emplace_back((match.source.array() + k).cos());
      std::vector<NodeCovector> products;
      std::vector<PathDirection> solved;
      for (const PathMatch* each : {&match, &halved}) {
        const MatchingProblem problem = each->problem();
        const EffectiveHamiltonian system(problem.system, problem.lambda);
        const std::optional<DiscretePath> path = along(system, problem.grid, nodes);
        ASSERT_TRUE(path);
        EXPECT_EQ(path->cometrics.front().is_on_line(), each == &match);
        const PathModel model(system, *problem.data, *path, 1.7);
        // A direction's momenta are what makes its nodes in the fields of the model, which the two may keep or not.
        PathDirection along_it = direction;
        for (std::size_t k = 0; k < along_it.momenta.size(); ++k) {
          const Points dq = 0.5 * (direction.nodes[k] + direction.nodes[k + 1]);
          along_it.momenta[k] = path->cometrics[k].solve(
              (direction.nodes[k + 1] - direction.nodes[k]) / problem.grid.dt() - path->gradients[k].cwiseProduct(dq));
        }
        products.push_back(model.hessian(along_it));
        solved.push_back(model.solve(products.front()));
      }
      for (std::size_t j = 1; j <= kNodes; ++j) {
        EXPECT_LE((products[0][j] - products[1][j]).norm(), 1e-9 * products[1][j].norm()) << kernel << noise << j;
        if (std::string(noise) != "none") continue;
        EXPECT_LE((solved[0].nodes[j] - solved[1].nodes[j]).norm(), 1e-7 * solved[1].nodes[j].norm()) << kernel << j;
      }
    }
  }
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

// λ Σ Δt ½ v·A⁻¹v + ½|r|²/σ² of the recorded nodes, A = K + λβ², by a dense matrix: whatever momenta are recorded.
double cost_of_nodes(const Registration& found, double beta) {
  const KernelOperator kernel = make_kernel(found.kernel);
  const double dt = found.grid.dt();
  double sum = 0.5 * found.residuals_over_sigma().squaredNorm();
  for (std::size_t k = 0; k + 1 < found.states.size(); ++k) {
    const Points middle = 0.5 * (found.states[k].q + found.states[k + 1].q);
    const VectorXd v = (found.states[k + 1].q - found.states[k].q).transpose() / dt;
    MatrixXd a = kernel.gram(middle, middle);
    a.diagonal().array() += found.lambda * beta * beta + regularisation(kernel);
    sum += found.lambda * dt * 0.5 * v.dot(a.llt().solve(v));
  }
  return sum;
}

// Markers much closer than the kernel is wide, a run of which is in reverse order: fields in space are too steep for
// steps there, and the search must still match them.
TEST(RegistrationAlongLine, MatchesARunInReverseOrder) {
  for (const char* kernel : {"matern32:alpha=2", "matern52:alpha=2", "peakon:alpha=2"}) {
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
    EXPECT_NEAR(found.cost.total(), cost_of_nodes(found, beta), 1e-7 * found.cost.total()) << kernel;
  }
}

// Few landmarks, far apart in widths of the kernel, of which six are reversed: fields do not let them pass.
TEST(RegistrationAlongLine, ReversesFewLandmarksOfANarrowKernel) {
  Landmarks source, target;
  source.points.resize(1, 12);
  for (int a = 0; a < 12; ++a) source.points(a) = a + 0.3 * std::sin(7.0 * a);
  target.points = source.points.array() + 5;
  target.points.middleCols(3, 6).rowwise().reverseInPlace();
  RegistrationOptions options;
  options.noise = "ch-sd:beta=0.3";
  options.sigma = Length(0.05);
  options.align = AlignmentKind::kNone;
  options.lambda = 1e-3;
  options.grid = {1, 20};
  for (const char* kernel : {"peakon:alpha=0.3", "matern32:alpha=0.3", "gaussian:alpha=0.3"}) {
    options.kernel = kernel;
    const Registration found = register_shapes(source, target, options);
    EXPECT_TRUE(found.converged) << kernel;
    EXPECT_LT(found.rms(), 0.1 * found.sigma) << kernel;
    EXPECT_NEAR(found.cost.total(), cost_of_nodes(found, 0.3), 1e-7 * found.cost.total()) << kernel;
  }
}

}  // namespace
}  // namespace pulson::matching
