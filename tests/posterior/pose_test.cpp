// The residual of aligned data: it does not depend on the pose, has these derivatives, and is the integral over poses.

#include "posterior/pose.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "core/determined.hpp"
#include "core/undefined.hpp"
#include "posterior/fitted_draws.hpp"
#include "posterior/minimum.hpp"
#include "posterior/size_exponent.hpp"
#include "posterior/specimen.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random/normals.hpp"
#include "random_numbers.hpp"

namespace pulson::posterior {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Random = pulson::Numbers;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

matching::MatchingProblem problem_of(const Points& source, matching::LandmarkObservations data) {
  const double sigma = data.sigma;
  Landmarks shape;
  shape.points = source;
  return {{make_kernel("gaussian:alpha=0.7", source), make_noise("none", shape)},
          make_integrator("variational-2"),
          {1, 4},
          source,
          std::make_shared<matching::LandmarkTerm>(data),
          sigma,
          5,
          {}};
}

Specimen::Model model_of(const Specimen& specimen) {
  const matching::MatchingProblem& problem = specimen.problem();
  return specimen.model(
      {std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise, problem.lambda, 1});
}

class OfKinds : public testing::TestWithParam<std::tuple<AlignmentKind, int>> {
 protected:
  static constexpr int kCount = 8;
  AlignmentKind kind = std::get<0>(GetParam());
  int d = std::get<1>(GetParam());
  Random random{11};
  Points source = random.landmarks(d, kCount);

  // Of unequal weights, a landmark missing and one of which a coordinate is.
  Specimen specimen() {
    Points target = source + 0.2 * random(d, kCount);
    target.col(3).setConstant(kMissing);
    if (d > 1) target(0, 5) = kMissing;
    VectorXd weights = VectorXd::Ones(kCount);
    weights[1] = 0.3;
    weights[6] = 0;
    return {problem_of(source, {target, 0.1, weights, {}}), kind};
  }

  Points moved(const Points& q) {
    MatrixXd linear = MatrixXd::Identity(d, d) + 0.4 * random(d, d);
    if (kind == AlignmentKind::kTranslation) linear.setIdentity();
    if (kind == AlignmentKind::kRigid || kind == AlignmentKind::kSimilarity) {
      MatrixXd turn = Eigen::HouseholderQR<MatrixXd>(linear).householderQ();
      if (turn.determinant() < 0) turn.col(0) *= -1;
      linear = (kind == AlignmentKind::kSimilarity ? 1.3 : 1) * turn;
    }
    const VectorXd shift = random(d, 1);
    return (linear * q).colwise() + shift;
  }
};
INSTANTIATE_TEST_SUITE_P(All, OfKinds,
                         testing::Combine(testing::Values(AlignmentKind::kTranslation, AlignmentKind::kRigid,
                                                          AlignmentKind::kSimilarity, AlignmentKind::kAffine),
                                          testing::Values(1, 2, 3)),
                         [](const auto& of) {
                           return alignment_name(std::get<0>(of.param)) + "In" + std::to_string(std::get<1>(of.param)) +
                                  "D";
                         });

TEST_P(OfKinds, ThePoseOfPositionsIsLeftOut) {
  const Specimen one = specimen();
  const Specimen::Model model = model_of(one);
  const Index coordinates = d * (kCount - 2) - (d > 1 ? 1 : 0);
  EXPECT_EQ(one.coordinates(), coordinates - alignment_parameters(kind, d));
  const Points q = source + 0.3 * random(d, kCount);
  const VectorXd residual = one.residual(model, q.reshaped()).head(one.coordinates());
  EXPECT_GT(residual.norm(), 0.1);
  const VectorXd of_moved = one.residual(model, moved(q).reshaped());
  EXPECT_LE((of_moved.head(one.coordinates()) - residual).norm(), 1e-11 * residual.norm());
  EXPECT_NEAR(one.log_likelihood(model, of_moved), one.log_likelihood(model, one.residual(model, q.reshaped())),
              1e-10 * residual.squaredNorm());
}

// Of twice the positions B is twice as much, and where B is 1 the slope of the square of r_B is that of −e log B.
TEST_P(OfKinds, TheSizeIsThatOfThePositionsAndItsSquareHasASlope) {
  const Specimen one = specimen();
  const auto sizes = one.data() - one.coordinates();
  const bool is_matrix = kind == AlignmentKind::kAffine;
  ASSERT_EQ(sizes, is_matrix ? d * d : kind == AlignmentKind::kSimilarity ? 1 : 0);
  if (sizes == 0) return;
  const MatrixXd unit = MatrixXd::Identity(is_matrix ? d : 1, is_matrix ? d : 1);
  Specimen::Model model = model_of(one);
  const auto size_of = [&](const Points& q) {  // B, less c·1
    return VectorXd(one.residual(model, q.reshaped()).tail(sizes).cwiseProduct(one.units(model).tail(sizes)));
  };
  const Points q = source + 0.1 * random(d, kCount);
  for (const double exponent : {-3.0, 0.0, 20.0}) {
    model.size_exponent = exponent;
    const double of_one = exponent / (is_matrix ? d : 1), k = std::max(of_one, 1.0), c = 1 + of_one / k;
    const VectorXd centre = c * unit.reshaped();
    EXPECT_LE((size_of(2 * q) + centre - 2 * (size_of(q) + centre)).norm(), 1e-12);
    const auto excess = [&](double size) {
      VectorXd residual = VectorXd::Zero(one.data());
      residual.tail(sizes) = std::sqrt(k) * (size - c) * unit.reshaped();
      return one.size_excess(model, residual);
    };
    EXPECT_NEAR(excess(1), 0, 1e-12);
    EXPECT_NEAR((excess(1 + 1e-4) - excess(1 - 1e-4)) / 2e-4, -exponent, 1e-8);
  }
}

TEST_P(OfKinds, ProjectionsAreDerivatives) {
  const Specimen one = specimen();
  const Specimen::Model model = model_of(one);
  const VectorXd q = moved(source + 0.3 * random(d, kCount)).reshaped();
  const MatrixXd slopes = one.units(model).cwiseInverse().asDiagonal() * one.projection(q);
  for (int trial = 0; trial < 4; ++trial) {
    const VectorXd change = 1e-5 * random(static_cast<int>(q.size()), 1);
    const VectorXd difference = one.residual(model, q + change) - one.residual(model, q - change);
    EXPECT_LE((difference - 2 * slopes * change).norm(), 1e-7 * difference.norm());
  }
}

// A pose of unit density along orthonormal directions at y: |y|² d log s dφ and N dt of a similarity of the plane.
TEST(Pose, IsIntegratedOver) {
  Random random(4);
  constexpr int kCount = 6;
  constexpr double kError = 0.01;
  const Points source = random.landmarks(2, kCount);
  const Points target = source + 0.2 * random(2, kCount);
  const Specimen specimen(problem_of(source, {target, kError, {}, {}}), AlignmentKind::kSimilarity);
  const Specimen::Model model = model_of(specimen);
  const Points about_mean = target.colwise() - target.rowwise().mean();
  const double size = about_mean.norm();
  for (const double apart : {0.0, 1.0, 3.0}) {  // of the errors
    const double turn = 0.3 * apart, scale = 1 + 0.2 * apart;
    MatrixXd motion{{std::cos(turn), -std::sin(turn)}, {std::sin(turn), std::cos(turn)}};
    const Points q = scale * motion * (target + apart * kError * random(2, kCount));
    const Points centred = q.colwise() - q.rowwise().mean();
    double sum = 0;
    const double step = 0.2 * kError / size;
    for (int i = -60; i <= 60; ++i)
      for (int j = -60; j <= 60; ++j) {
        const double factor = std::exp(i * step) / scale, angle = j * step - turn;
        const MatrixXd back{{std::cos(angle), -std::sin(angle)}, {std::sin(angle), std::cos(angle)}};
        sum += std::exp(-0.5 * (factor * back * centred - about_mean).squaredNorm() / (kError * kError));
      }
    const double all = std::pow(size * step, 2) * sum * 2 * std::numbers::pi * kError * kError;  // with ∫ N dt
    const double expected = std::log(all) - 2 * kCount * std::log(std::sqrt(2 * std::numbers::pi) * kError);
    const double found = specimen.log_likelihood(model, specimen.residual(model, q.reshaped()));
    const double misfit = apart * kError * std::sqrt(2.0 * kCount) / size;
    EXPECT_NEAR(found, expected, 1e-3 + std::pow(misfit, 2) * (1 + std::pow(apart, 2) * kCount)) << apart;
  }
}

double log_mean(const VectorXd& logs) {
  return logs.maxCoeff() + std::log((logs.array() - logs.maxCoeff()).exp().mean());
}

// An oval whose landmarks are moved by a tenth of its size, and its evidence by fitted draws about the minimum.
struct FreeSize {
  FreeSize(int count, double sigma) : specimen(problem(count, sigma), AlignmentKind::kSimilarity) {}

  static matching::MatchingProblem problem(int count, double sigma) {
    Random random(4);
    Points oval(2, count);
    for (int a = 0; a < count; ++a) {
      const double angle = 2 * std::numbers::pi * a / count;
      oval.col(a) << std::cos(angle), 0.7 * std::sin(angle);
    }
    matching::MatchingProblem problem = problem_of(oval, {oval + 0.1 * random(2, count), sigma, {}, {}});
    problem.lambda = 50;
    Landmarks shape;
    shape.points = oval;
    problem.system.noise = make_noise("ch-sd:beta=0.1", shape);
    return problem;
  }

  struct Evidences {
    double laplace, draws, effective;
  };
  Evidences evidences(const Specimen::Model& model) const {
    constexpr int kDraws = 256;
    const Minimum minimum = find_minima({&specimen}, model, {{}}).front();
    const LinearAt linear(*minimum.linear, model);
    const ShotBatch shots(specimen, model, &linear);
    const auto size = static_cast<int>(specimen.unknowns() + specimen.data());
    const FittedDraws draws = fitted_draws(shots, linear, standard_normals(2, 0, size, kDraws), 1e-2);
    VectorXd weights = -fitted_log_densities(shots, linear, draws.z, draws.residuals);
    for (Index l = 0; l < kDraws; ++l)
      weights[l] = draws.found[static_cast<std::size_t>(l)]
                       ? weights[l] + specimen.log_likelihood(model, draws.residuals.col(l))
                       : kImpossible;
    const Eigen::ArrayXd relative = (weights.array() - weights.maxCoeff()).exp();
    return {linear.laplace(), log_mean(weights), relative.sum() * relative.sum() / relative.square().sum() / kDraws};
  }

  Specimen specimen;
};

TEST(Pose, TheEvidenceOfAFreeSizeIsThatOfDrawsFromThePrior) {
  const FreeSize of(8, 0.1);
  Specimen::Model model = model_of(of.specimen);
  model.size_exponent = SizeExponent(of.specimen, model).at(model);
  const ShotBatch shots(of.specimen, model);
  const double of_prior = log_mean(
      shots.log_likelihoods(shots.ends(standard_normals(1, 0, static_cast<int>(of.specimen.unknowns()), 1 << 16))));
  const FreeSize::Evidences found = of.evidences(model);
  EXPECT_NEAR(found.draws, of_prior, 0.05);
  EXPECT_NEAR(found.laplace, of_prior, 0.1);
}

// What makes the shape larger changes all that the others do to it: the minimum is far from most of the posterior
// unless it is known how much.
TEST(Pose, AFreeSizeMovesThePosterior) {
  const FreeSize of(12, 0.03);
  Specimen::Model model = model_of(of.specimen);
  const FreeSize::Evidences without = of.evidences(model);
  model.size_exponent = SizeExponent(of.specimen, model).at(model);
  const FreeSize::Evidences found = of.evidences(model);
  EXPECT_GT(model.size_exponent, 5);
  EXPECT_NEAR(found.draws, without.draws, 0.2);
  EXPECT_GE(found.effective, 0.7);
  EXPECT_LE(without.effective, 0.5);
}

}  // namespace
}  // namespace pulson::posterior
