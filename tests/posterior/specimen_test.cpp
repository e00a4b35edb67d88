// The contract of the posterior of one shape, for noises and integrators alike.

#include "posterior/specimen.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <tuple>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "posterior/minimum.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random_numbers.hpp"

namespace pulson::posterior {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Random = pulson::Numbers;

constexpr double kSigma = 0.1;

Landmarks shape_of(Points points) {
  Landmarks shape;
  shape.points = std::move(points);
  return shape;
}

matching::MatchingProblem problem_of(const std::string& noise, const std::string& integrator) {
  Random numbers(3);
  const Points source = numbers.landmarks(2, 4);
  const Points target = source + 0.1 * numbers(2, 4);
  return {{make_kernel("gaussian:alpha=0.7", source), make_noise(noise, shape_of(source))},
          make_integrator(integrator),
          {1, 4},
          source,
          std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{target, kSigma, {}, {}}),
          kSigma,
          5,
          {}};
}

class OfModels : public testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  OfModels()
      : specimen(problem_of(std::get<0>(GetParam()), std::get<1>(GetParam()))), model(specimen.model(numbers())) {
    Random random(7);
    z = 0.4 * random(specimen.unknowns(), 1);
  }

  posterior::Numbers numbers(double lambda = 1, double sigma = 1, double amplitude = 1) const {
    const matching::MatchingProblem& problem = specimen.problem();
    std::shared_ptr<const NoiseModel> noise = problem.system.noise;
    VectorXd theta = noise->parameters();
    for (const NoiseAmplitude& a : noise->amplitudes(2, 4)) theta[a.parameter] *= amplitude;
    if (theta.size() > 0) noise = noise->with_parameters(theta);
    return {std::make_shared<KernelOperator>(problem.system.kernel), noise, lambda * problem.lambda, sigma};
  }

  Specimen specimen;
  Specimen::Model model;
  VectorXd z;
};
INSTANTIATE_TEST_SUITE_P(All, OfModels,
                         testing::Combine(testing::Values("none", "ch-sd:beta=0.05", "ch-sd-screened:beta=0.05,gamma=1",
                                                          "p-sd:fields=grid,count=2,beta=0.1",
                                                          "trouve-vialard:sigma=0.3", "kunita:beta=0.05,width=0.5",
                                                          "potential:beta=0.05,gamma=1"),
                                          testing::Values("variational-2", "heun")),
                         [](const auto& row) { return "Case" + std::to_string(row.index); });

TEST_P(OfModels, WhiteUndoesMomentaAndIncrements) {
  const VectorXd back = specimen.white(model, specimen.momenta(model, z), specimen.increments(0, z));
  EXPECT_LE((back - z).norm(), 1e-10 * z.norm());
  // |z0|² is λ p0ᵀ(K + ε)p0, ε a thousandth of what moves a landmark by σ.
  const Points p = specimen.momenta(model, z);
  const double energy =
      5 * (p.transpose() * model.system.kernel.apply(specimen.problem().source, specimen.problem().source, p)).trace();
  EXPECT_NEAR(z.head(8).squaredNorm(), energy, 1e-2 * energy);
}

TEST_P(OfModels, SlopesAndTheirTransposeAreTheDerivative) {
  const auto shot = specimen.shoot(model, z);
  ASSERT_TRUE(shot);
  const LinearModel linear(specimen, model, *shot, z);
  const LinearAt at(linear, model);
  Random random(9);
  const VectorXd along = random(specimen.unknowns(), 1);
  constexpr double kStep = 1e-5;
  const VectorXd difference =
      (specimen.shoot(model, z + kStep * along)->residual - specimen.shoot(model, z - kStep * along)->residual) /
      (2 * kStep);
  EXPECT_LE((at.apply(along) - difference).norm(), 1e-6 * difference.norm());
  EXPECT_LE((at.residual(z) - shot->residual).norm(), 1e-9 * (1 + shot->residual.norm()));
  const VectorXd v = random(specimen.data(), 1);
  EXPECT_NEAR(v.dot(at.apply(along)), at.transposed(v).dot(along), 1e-9 * v.norm() * along.norm());
  EXPECT_LE((specimen.transposed(model, *shot, v) - at.transposed(v)).norm(), 1e-8 * at.transposed(v).norm());
}

// As lanes or one by one.
TEST_P(OfModels, ABatchHasTheShotsOfEach) {
  Random random(11);
  const auto first = specimen.shoot(model, z);
  ASSERT_TRUE(first);
  const LinearModel linear(specimen, model, *first, z);
  const LinearAt chord(linear, model);
  const ShotBatch batch(specimen, model, &chord);
  const MatrixXd all = 0.3 * random(specimen.unknowns(), batch.at_once() + 1);
  const ShotBatch::Ends ends = batch.ends(all);
  const auto products = batch.products(all);
  const auto slopes = batch.slopes(all);
  for (Index l = 0; l < all.cols(); ++l) {
    const auto i = static_cast<std::size_t>(l);
    const auto shot = specimen.shoot(model, all.col(l));
    ASSERT_EQ(shot.has_value(), ends.found[i] != 0);
    if (!shot) continue;
    EXPECT_LE((specimen.residual(model, ends.positions.col(l)) - shot->residual).norm(), 1e-10);
    const Specimen::Slopes one = specimen.slopes(model, *shot);
    EXPECT_LE((slopes[i].momenta - one.momenta).norm(), 1e-10 * one.momenta.norm());
    const MatrixXd product = chord.product(one, model);
    EXPECT_LE((products[i] - product).norm(), 1e-10 * product.norm());
  }
}

// A linear model is that of the same path for other λ and σ, and for other amplitudes where the path is linear in the
// increments, as these schemes are but for the noise's own dependence on positions.
TEST_P(OfModels, LinearModelsAreRescaledExactly) {
  const auto shot = specimen.shoot(model, z);
  ASSERT_TRUE(shot);
  const LinearModel linear(specimen, model, *shot, z);
  const double amplitude = 1.7;
  const Specimen::Model other = specimen.model(numbers(2.3, 0.6, amplitude));
  const VectorXd same_path = specimen.white(other, specimen.momenta(model, z), specimen.increments(0, z) / amplitude);
  const auto again = specimen.shoot(other, same_path);
  ASSERT_TRUE(again);
  const LinearModel linear_anew(specimen, other, *again, same_path);
  const LinearAt anew(linear_anew, other);
  const LinearAt rescaled(linear, other);
  EXPECT_NEAR(rescaled.log_evidence(), anew.log_evidence(), 1e-6 * std::abs(anew.log_evidence()));
  EXPECT_LE((rescaled.mean() - anew.mean()).norm(), 1e-6 * anew.mean().norm());
  const MatrixXd covariance = linear.covariance(other);
  const VectorXd v = Random(2)(specimen.data(), 1);
  EXPECT_LE((covariance * v - other.sigma * other.sigma * (v + rescaled.apply(rescaled.transposed(v)))).norm(),
            1e-9 * (covariance * v).norm());
}

// The gradient z + Jᵀr vanishes at a minimum, alone and among others.
TEST_P(OfModels, MinimaAreStationary) {
  const std::vector<Minimum> minima =
      find_minima({&specimen, &specimen}, model, {{z}, {}}, {.tolerance = 1e-8, .most_steps = 60});
  for (const Minimum& minimum : minima) {
    EXPECT_TRUE(minimum.converged);
    const auto shot = specimen.shoot(model, minimum.z);
    const VectorXd gradient = minimum.z + specimen.transposed(model, *shot, shot->residual);
    EXPECT_LE(gradient.norm(), 1e-3);
    EXPECT_NEAR(minimum.cost, 0.5 * (minimum.z.squaredNorm() + shot->residual.squaredNorm()), 1e-9);
  }
  EXPECT_NEAR(minima[0].cost, minima[1].cost, 1e-6);
}

// A circle to one with three bumps, by a kernel that is wide: momenta that move nothing to first order make paths bend.
matching::MatchingProblem bumpy_circle(int count, double alpha, double bump, const std::string& integrator) {
  constexpr double kSmall = 0.01;
  matching::MatchingProblem problem = problem_of("ch-sd:beta=0.03", integrator);
  problem.grid = {1, 10};
  problem.source.resize(2, count);
  Points target(2, count);
  for (int a = 0; a < count; ++a) {
    const double phi = 2 * std::numbers::pi * a / count;
    problem.source.col(a) << std::cos(phi), std::sin(phi);
    target.col(a) = (1 + bump * std::cos(3 * phi)) * problem.source.col(a);
  }
  problem.data = std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{target, kSmall, {}, {}});
  problem.sigma = kSmall;
  problem.lambda = 0.25;
  problem.system = {make_kernel("gaussian:alpha=" + std::to_string(alpha), problem.source),
                    make_noise("ch-sd:beta=0.03", shape_of(problem.source))};
  return problem;
}

// From rest, and at no more than what registration finds, which holds such momenta at 0. With steps that are halved
// until the cost falls, 4 of the 24 searches ended at a cost of 500 to 11,600, where the minima are 1 to 2.2; with
// these one crawls in its valley.
TEST(Minima, AreFoundWhereMomentaThatMoveLittleBendThePaths) {
  int converged = 0;
  for (const double bump : {0.4, 0.5, 0.6, 0.7})
    for (const double alpha : {0.6, 1.2})
      for (const int count : {12, 16, 20}) {
        const bool is_even = count == 16;
        const matching::MatchingProblem problem =
            bumpy_circle(count, alpha, bump, is_even == (alpha > 1) ? "heun" : "variational-2");
        const Specimen specimen(problem);
        const Specimen::Model model = specimen.model(
            {std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise, problem.lambda, 1});
        const Minimum minimum = find_minima({&specimen}, model, {{}}).front();
        if (!minimum.converged) continue;
        ++converged;
        const matching::MatchingObjective objective(problem);
        const matching::MinimiseSummary known = minimise(objective, {.gradient_tolerance = 1e-5});
        EXPECT_LE(minimum.cost, known.solution.cost.total() + 1e-4) << count << ' ' << alpha << ' ' << bump;
      }
  EXPECT_GE(converged, 22);
}

// Covariance of the momenta along one axis, N×N: draws are linear in z.
MatrixXd prior_covariance(const matching::MatchingProblem& problem) {
  const Specimen specimen(problem, {}, MomentumPrior::kSmooth);
  const Specimen::Model model = specimen.model(
      {std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise, problem.lambda, 1});
  const Index n = problem.source.cols();
  MatrixXd root = MatrixXd::Zero(n, specimen.unknowns());
  for (Index i = 0; i < specimen.unknowns(); ++i)
    root.col(i) = specimen.momenta(model, VectorXd::Unit(specimen.unknowns(), i)).row(1);
  return root * root.transpose();
}

matching::MatchingProblem dense_ring(const std::string& noise) {
  constexpr int kCount = 12;
  matching::MatchingProblem problem = problem_of(noise, "heun");
  problem.grid = {2, 4};
  problem.source.resize(2, kCount);
  for (int a = 0; a < kCount; ++a)
    problem.source.col(a) << std::cos(2 * std::numbers::pi * a / kCount), std::sin(2 * std::numbers::pi * a / kCount);
  problem.system = {make_kernel("matern32:alpha=2", problem.source), make_noise(noise, shape_of(problem.source))};
  problem.data =
      std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{problem.source, kSigma, {}, {}});
  return problem;
}

TEST(SmoothMomenta, HaveHalfTheVarianceWhereThatIsThreeDeviationsOfNoiseAndErrors) {
  constexpr double kBeta = 0.2;
  const matching::MatchingProblem problem = dense_ring("ch-sd:beta=0.2");
  const MatrixXd covariance = prior_covariance(problem);
  const double time = problem.grid.time, lambda = problem.lambda;
  const double hidden = 9 * (kSigma * kSigma + time * kBeta * kBeta) / (time * time) * lambda;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(problem.system.kernel.gram(problem.source, problem.source));
  EXPECT_LT(eigen.eigenvalues().minCoeff(), hidden / 3);
  EXPECT_GT(eigen.eigenvalues().maxCoeff(), 3 * hidden);
  for (Index i = 0; i < covariance.rows(); ++i) {
    const double kappa = eigen.eigenvalues()[i];
    const VectorXd v = eigen.eigenvectors().col(i);
    const double variance = v.dot(covariance * v);
    EXPECT_NEAR(variance * lambda * (kappa + hidden * hidden / kappa), 1, 1e-2);  // up to ε
  }
}

TEST(SmoothMomenta, FadeByTheCovarianceOfFieldsThatMoveNeighboursTogether) {
  const matching::MatchingProblem problem = dense_ring("kunita:beta=0.2,width=1.5");
  const MatrixXd covariance = prior_covariance(problem);
  const NoiseModel& noise = *problem.system.noise;
  const Index n = problem.source.cols();
  const int channels = noise.channels(2, static_cast<int>(n));
  MatrixXd moved = MatrixXd::Zero(n, n);  // by unit increments from rest
  for (Index i = 0; i < channels; ++i) {
    const Points velocity = noise.rest_velocity(problem.source, VectorXd::Unit(channels, i));
    moved += velocity.transpose() * velocity / 2;
  }
  EXPECT_GT(moved.norm(), 1.5 * moved.diagonal().norm());  // together
  const double time = problem.grid.time;
  const MatrixXd s = 9 * (kSigma * kSigma * MatrixXd::Identity(n, n) + time * moved) / (time * time);
  const MatrixXd k = problem.system.kernel.gram(problem.source, problem.source);
  const MatrixXd precision = problem.lambda * (k + problem.lambda * problem.lambda * s * k.llt().solve(s));
  EXPECT_LE((precision * covariance - MatrixXd::Identity(n, n)).norm(), 0.05);
}

TEST(SmoothMomenta, LeaveSeparateLandmarksAsTheyAre) {
  matching::MatchingProblem problem = dense_ring("ch-sd:beta=0.001");
  problem.system.kernel = make_kernel("gaussian:alpha=0.1", problem.source);
  problem.sigma = 1e-3;
  const Index n = problem.source.cols();
  EXPECT_LE((problem.lambda * prior_covariance(problem) - MatrixXd::Identity(n, n)).norm(), 1e-3);
}

}  // namespace
}  // namespace pulson::posterior
