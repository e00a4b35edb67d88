// Alignment of curves without correspondence: known poses of a curve that is sampled elsewhere.

#include "curve_alignment.hpp"

#include <cmath>
#include <functional>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using CurveFormula = std::function<VectorXd(double)>;

// A closed curve at equal steps of its parameter, in [0, 2π), from `phase`.
Curve sampled(const CurveFormula& at, int count, double phase) {
  Curve curve{Points(at(0).size(), count), {}};
  for (int a = 0; a < count; ++a) {
    curve.points.col(a) = at(phase + 2 * std::numbers::pi * a / count);
    curve.edges.emplace_back(a, (a + 1) % count);
  }
  return curve;
}

// No turn and no reflection maps it to itself.
VectorXd outline(double t) {
  const double r = 1 + 0.3 * std::cos(t) + 0.25 * std::cos(2 * t - 1) + 0.1 * std::sin(3 * t);
  return Eigen::Vector2d(1.4 * r * std::cos(t), r * std::sin(t));
}

VectorXd space_curve(double t) {
  return Eigen::Vector3d(1.5 * std::cos(t) + 0.3 * std::sin(2 * t), std::sin(t) + 0.2 * std::cos(3 * t),
                         0.5 * std::sin(2 * t - 0.7) + 0.2 * std::cos(t));
}

Alignment motion(double scale, const MatrixXd& linear, const VectorXd& translation) {
  return {AlignmentKind::kSimilarity, scale, linear, translation};
}

// The largest distance of two images of a curve.
double apart(const CurveFormula& curve, const Alignment& found, const Alignment& expected) {
  const Points x = sampled(curve, 50, 0).points;
  return (found.apply(x) - expected.apply(x)).colwise().norm().maxCoeff();
}

Alignment aligned(const CurveFormula& curve, const Alignment& by, AlignmentKind kind,
                  const CurveAlignmentOptions& options = {CurveMeasure::kVarifold, 0.1}) {
  Curve target = sampled(curve, 83, 0.4);
  target.points = by.apply(target.points);
  return align_curves(sampled(curve, 60, 0), target, kind, options);
}

// Polygons of 60 and 83 vertices are some (2π/60)²/8 = 1.4e-3 of the radius of curvature off the curve.
constexpr double kSampling = 5e-3;

TEST(CurveAlignment, FindsAKnownSimilarityOfAnotherSampling) {
  for (const double angle : {0.3, 1.9, 3.1, -1.2}) {
    const Alignment by = motion(1.7, Eigen::Rotation2Dd(angle).toRotationMatrix(), Eigen::Vector2d(5, -3));
    const Alignment found = aligned(outline, by, AlignmentKind::kSimilarity);
    EXPECT_LT(apart(outline, found, by), 1.7 * kSampling) << angle;
    EXPECT_EQ(found.kind, AlignmentKind::kSimilarity);
    EXPECT_NEAR(found.linear.determinant(), 1, 1e-12);
  }
}

TEST(CurveAlignment, ARigidMapDoesNotScale) {
  const Alignment by = motion(1, Eigen::Rotation2Dd(2.4).toRotationMatrix(), Eigen::Vector2d(0.2, 7));
  const Alignment found = aligned(outline, by, AlignmentKind::kRigid);
  EXPECT_LT(apart(outline, found, by), kSampling);
  EXPECT_EQ(found.scale, 1);
  EXPECT_EQ(aligned(outline, motion(1.5, by.linear, by.translation), AlignmentKind::kRigid).scale, 1);
}

TEST(CurveAlignment, FindsAKnownSimilarityInSpace) {
  for (const Eigen::Vector4d& turn : {Eigen::Vector4d(0.3, -0.8, 0.5, 0.1), Eigen::Vector4d(-0.7, 0.1, 0.2, 0.6)}) {
    const Alignment by =
        motion(0.6, Eigen::Quaterniond(turn).normalized().toRotationMatrix(), Eigen::Vector3d(1, 2, -4));
    const Alignment found = aligned(space_curve, by, AlignmentKind::kSimilarity);
    EXPECT_LT(apart(space_curve, found, by), 0.6 * kSampling);
    EXPECT_NEAR(found.linear.determinant(), 1, 1e-12);
  }
}

TEST(CurveAlignment, AMirrorImageIsReachedByAReflectionAlone) {
  MatrixXd mirror = MatrixXd::Identity(2, 2);
  mirror(1, 1) = -1;
  const Alignment by = motion(1.2, Eigen::Rotation2Dd(0.8) * mirror, Eigen::Vector2d(1, 1));
  const Alignment turned = aligned(outline, by, AlignmentKind::kSimilarity);
  EXPECT_NEAR(turned.linear.determinant(), 1, 1e-12);
  EXPECT_GT(apart(outline, turned, by), 0.5);
  const Alignment reflected = aligned(outline, by, AlignmentKind::kSimilarity, {CurveMeasure::kVarifold, 0.1, true});
  EXPECT_NEAR(reflected.linear.determinant(), -1, 1e-12);
  EXPECT_LT(apart(outline, reflected, by), 1.2 * kSampling);
}

// Reflecting where nothing asks for it fits no better.
TEST(CurveAlignment, NoReflectionIsTakenWithoutNeed) {
  const Alignment by = motion(1, Eigen::Rotation2Dd(0.8).toRotationMatrix(), Eigen::Vector2d(1, 1));
  const Alignment found = aligned(outline, by, AlignmentKind::kSimilarity, {CurveMeasure::kCurrent, 0.1, true});
  EXPECT_LT(apart(outline, found, by), kSampling);
}

// Half a turn of an ellipse costs the same: the first start is none.
TEST(CurveAlignment, OfEqualPosesTakesTheSmallestTurn) {
  const CurveFormula ellipse = [](double t) { return VectorXd(Eigen::Vector2d(2 * std::cos(t), std::sin(t))); };
  const Alignment by = motion(1, Eigen::Rotation2Dd(0.2).toRotationMatrix(), Eigen::Vector2d(1, 1));
  EXPECT_LT(apart(ellipse, aligned(ellipse, by, AlignmentKind::kSimilarity), by), 2 * kSampling);
}

TEST(CurveAlignment, ATranslationJoinsTheMiddlesOfEdges) {
  const Alignment by = motion(1, MatrixXd::Identity(2, 2), Eigen::Vector2d(3, -2));
  EXPECT_LT(apart(outline, aligned(outline, by, AlignmentKind::kTranslation), by), kSampling);
  EXPECT_EQ(aligned(outline, by, AlignmentKind::kNone).translation, VectorXd::Zero(2));
}

// And in its record; what is left for the flow is what the sampling leaves.
TEST(CurveAlignment, IsTheDefaultOfARegistration) {
  const Alignment by = motion(1.5, Eigen::Rotation2Dd(2).toRotationMatrix(), Eigen::Vector2d(4, 1));
  Landmarks source, target;
  source.points = sampled(outline, 24, 0).points;
  target.points = by.apply(sampled(outline, 33, 0.1).points);
  RegistrationOptions options;
  options.data.kind = DataKind::kVarifold;
  options.sigma = 0.05;
  options.grid = {1, 5};
  const Registration fit = register_shapes(source, target, options);
  EXPECT_TRUE(fit.converged) << fit.stop_reason;
  EXPECT_EQ(fit.alignment.kind, AlignmentKind::kSimilarity);
  EXPECT_LT(apart(outline, fit.alignment, by), 0.05);
  EXPECT_LT(fit.initial_rms(), 0.05);  // sagittae of up to 1.5 × 2 (2π/24)²/8 = 0.026, of both
}

TEST(CurveAlignment, RefusesAnAffineMap) {
  EXPECT_THROW(aligned(outline, motion(1, MatrixXd::Identity(2, 2), VectorXd::Zero(2)), AlignmentKind::kAffine),
               InputError);
}

}  // namespace
}  // namespace pulson::matching
