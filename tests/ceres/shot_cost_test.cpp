// A shot as a cost function of Ceres: its Jacobian against numerical derivatives, and matches that Ceres finds with it
// against those of matching.

#include "pulson/ceres/shot_cost.hpp"

#include <array>
#include <memory>

#include <ceres/gradient_checker.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;

Shot shot_of(const std::string& integrator, const std::string& noise, const Points& q0, int steps = 4) {
  Landmarks shape;
  shape.points = q0;
  return {{make_kernel("gaussian:alpha=0.7"), make_noise(noise, shape)}, make_integrator(integrator), {1, steps}, q0};
}

// By Ridders' extrapolation, in all three blocks.
TEST(ShotCost, HasTheJacobianOfItsEnd) {
  const std::array<std::array<std::string, 2>, 6> cases = {{{"rk4", "none"},
                                                            {"midpoint", "none"},
                                                            {"variational", "ch-sd:beta=0.3"},
                                                            {"variational-2", "p-sd:beta=0.2,fields=cos"},
                                                            {"heun", "trouve-vialard:sigma=0.3"},
                                                            {"variational", "potential:beta=0.2,gamma=0.5"}}};
  for (const auto& [integrator, noise] : cases)
    for (const bool at_rest : {false, true}) {
      SCOPED_TRACE(integrator + ' ' + noise + (at_rest ? " at rest" : ""));
      Numbers numbers(3);
      const Points q0 = numbers.landmarks(2, 3);
      const Points p0 = at_rest ? Points(Points::Zero(2, 3)) : Points(0.3 * numbers(2, 3));
      Shot shot = shot_of(integrator, noise, q0);
      const int channels = shot.system.noise->channels(2, 3);
      const MatrixXd increments = 0.2 * numbers(channels, shot.grid.steps);
      const ShotCost cost(shot, numbers(2, 3), 0.5, {.q0 = true, .increments = channels > 0});
      std::vector<const double*> blocks{p0.data(), q0.data()};
      if (channels > 0) blocks.push_back(increments.data());
      ceres::NumericDiffOptions options;
      options.ridders_relative_initial_step_size = 1e-2;
      const std::vector<const ceres::Manifold*>* const no_manifolds = nullptr;
      ceres::GradientChecker checker(&cost, no_manifolds, options);
      ceres::GradientChecker::ProbeResults results;
      // The checker's steps are tiny where a parameter is 0.
      EXPECT_TRUE(checker.Probe(blocks.data(), at_rest ? 1e-3 : 1e-6, &results)) << results.error_log;
    }
}

TEST(ShotCost, IsTheEndInUnitsOfSigma) {
  Numbers numbers(4);
  const Points q0 = numbers.landmarks(2, 4), p0 = 0.4 * numbers(2, 4), y = numbers(2, 4);
  const Shot shot = shot_of("rk4", "none", q0);
  const Points end = shot.integrator->integrate(shot.system, {q0, p0}, shot.grid, MatrixXd::Zero(0, 4)).final().q;
  const ShotCost plain(shot), scaled(shot, y, 0.1);
  EXPECT_EQ(plain.coordinates(), 8);
  EXPECT_THAT(plain.parameter_block_sizes(), testing::ElementsAre(8));
  Points r(2, 4);
  const double* block = p0.data();
  ASSERT_TRUE(plain.Evaluate(&block, r.data(), nullptr));
  EXPECT_EQ(r, end);
  ASSERT_TRUE(scaled.Evaluate(&block, r.data(), nullptr));
  EXPECT_LE((r - (end - y) / 0.1).norm(), 1e-12);
}

TEST(ShotCost, FailsWhereThereIsNoPath) {
  const Points q0 = Numbers(5).landmarks(2, 3);
  const ShotCost cost(shot_of("rk4", "none", q0));
  const Points p0 = 1e200 * Points::Ones(2, 3);
  const double* block = p0.data();
  Points r(2, 3);
  EXPECT_FALSE(cost.Evaluate(&block, r.data(), nullptr));
}

TEST(ShotCost, RefusesWhatDoesNotFit) {
  const Points q0 = Numbers(5).landmarks(2, 3);
  EXPECT_THROW(ShotCost(shot_of("rk4", "none", q0), Points::Zero(2, 4)), InputError);
  EXPECT_THROW(ShotCost(shot_of("rk4", "none", q0), {}, 0), InputError);
  Shot noisy = shot_of("heun", "ch-sd:beta=1", q0);
  noisy.increments = MatrixXd::Zero(6, 3);
  EXPECT_THROW(ShotCost{noisy}, InputError);
  EXPECT_THROW(energy_prior(noisy.system.kernel, q0, -1), InputError);
}

TEST(EnergyPrior, IsTheHamiltonian) {
  Numbers numbers(6);
  const Points q0 = numbers.landmarks(3, 4), p0 = numbers(3, 4);
  const KernelOperator kernel = make_kernel("matern32:alpha=0.9");
  const auto prior = energy_prior(kernel, q0, 2.5);
  Eigen::VectorXd r(12);
  const double* block = p0.data();
  ASSERT_TRUE(prior->Evaluate(&block, r.data(), nullptr));
  EXPECT_NEAR(0.5 * r.squaredNorm(), 2.5 * hamiltonian(kernel, {q0, p0}), 1e-12);
}

// From rest, by Levenberg–Marquardt, in a problem of two residuals.
TEST(ShotCost, SolvesAMatchAsTheGeodesicSearchDoes) {
  for (const int dimension : {2, 3}) {
    Numbers numbers(7);
    Landmarks source, target;
    source.points = numbers.landmarks(dimension, 6);
    target.points = source.points + 0.3 * numbers(dimension, 6);
    matching::RegistrationOptions options;
    options.kernel = "gaussian:alpha=0.7";
    options.sigma = 0.05;
    options.lambda = 0.8;
    options.align = AlignmentKind::kNone;
    options.minimise.gradient_tolerance = 1e-7;
    const matching::Registration expected = register_shapes(source, target, options);
    ASSERT_TRUE(expected.converged);

    const Shot shot = shot_of("rk4", "none", source.points, expected.grid.steps);
    Points p0 = Points::Zero(dimension, 6);
    ceres::Problem problem;
    problem.AddResidualBlock(new ShotCost(shot, target.points, 0.05), nullptr, p0.data());
    problem.AddResidualBlock(energy_prior(shot.system.kernel, shot.q0, 0.8).release(), nullptr, p0.data());
    ceres::Solver::Options how;
    how.linear_solver_type = ceres::DENSE_QR;
    how.function_tolerance = 1e-14;
    how.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(how, &problem, &summary);
    EXPECT_EQ(summary.termination_type, ceres::CONVERGENCE) << summary.message;
    EXPECT_NEAR(summary.final_cost, expected.cost.total(), 1e-5 * expected.cost.total());
    EXPECT_LE((p0 - expected.momenta).norm(), 1e-3 * expected.momenta.norm());
  }
}

}  // namespace
}  // namespace pulson
