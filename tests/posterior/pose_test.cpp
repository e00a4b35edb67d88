// The residual of aligned data: it does not depend on the pose, has these derivatives, and is the integral over poses.

#include "posterior/pose.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "core/determined.hpp"
#include "posterior/specimen.hpp"
#include "pulson/noise/noise_table.hpp"
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
  EXPECT_EQ(one.data(), coordinates - alignment_parameters(kind, d));
  const Points q = source + 0.3 * random(d, kCount);
  const VectorXd residual = one.residual(model, q.reshaped());
  EXPECT_GT(residual.norm(), 0.1);
  EXPECT_LE((one.residual(model, moved(q).reshaped()) - residual).norm(), 1e-11 * residual.norm());
}

TEST_P(OfKinds, ProjectionsAreDerivatives) {
  const Specimen one = specimen();
  const Specimen::Model model = model_of(one);
  const VectorXd q = moved(source + 0.3 * random(d, kCount)).reshaped();
  const MatrixXd slopes = one.projection(q);
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
    const double found = -0.5 * specimen.residual(model, q.reshaped()).squaredNorm() - specimen.log_volume(model);
    const double misfit = apart * kError * std::sqrt(2.0 * kCount) / size;
    EXPECT_NEAR(found, expected, 1e-3 + std::pow(misfit, 2) * (1 + std::pow(apart, 2) * kCount)) << apart;
  }
}

}  // namespace
}  // namespace pulson::posterior
