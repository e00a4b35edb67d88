#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <Eigen/LU>
#include <Eigen/QR>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::HasSubstr;

// A random rotation.
MatrixXd rotation(Numbers& numbers, int d) {
  MatrixXd q = Eigen::HouseholderQR<MatrixXd>(numbers(d, d)).householderQ();
  if (q.determinant() < 0) q.col(0) = -q.col(0);
  return q;
}

// The rotation by small angles: the Cayley transform of a skew matrix.
MatrixXd small_rotation(Numbers& numbers, int d) {
  const MatrixXd x = 1e-3 * numbers(d, d);
  const MatrixXd skew = x - x.transpose();
  return (MatrixXd::Identity(d, d) - skew).inverse() * (MatrixXd::Identity(d, d) + skew);
}

constexpr std::array kKinds = {AlignmentKind::kNone, AlignmentKind::kTranslation, AlignmentKind::kRigid,
                               AlignmentKind::kSimilarity};

TEST(Alignment, RecoversAMotion) {
  for (int d = 1; d <= 3; ++d) {
    for (const AlignmentKind kind : kKinds) {
      SCOPED_TRACE(alignment_name(kind) + " in dimension " + std::to_string(d));
      Numbers numbers(static_cast<unsigned>(d));
      const Points source = numbers.landmarks(d, 7);
      Alignment motion{kind, 1, MatrixXd::Identity(d, d), VectorXd::Zero(d)};
      if (kind != AlignmentKind::kNone) motion.translation = 3 * numbers(d, 1);
      if (kind == AlignmentKind::kRigid || kind == AlignmentKind::kSimilarity) motion.rotation = rotation(numbers, d);
      if (kind == AlignmentKind::kSimilarity) motion.scale = 2.5;
      const Alignment found = align(source, motion.apply(source), kind);
      EXPECT_EQ(found.kind, kind);
      EXPECT_NEAR(found.scale, motion.scale, 1e-14 * motion.scale);
      EXPECT_LE((found.rotation - motion.rotation).norm(), 1e-14);
      EXPECT_LE((found.translation - motion.translation).norm(), 1e-13);
      EXPECT_EQ(parse_alignment(alignment_name(kind)), kind);
    }
  }
}

TEST(Alignment, IsTheBestMotionAndNoReflection) {
  for (int d = 1; d <= 3; ++d) {
    for (const AlignmentKind kind : {AlignmentKind::kTranslation, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
      for (const bool mirrored : {false, true}) {
        SCOPED_TRACE(alignment_name(kind) + " in dimension " + std::to_string(d) + (mirrored ? ", mirrored" : ""));
        Numbers numbers(static_cast<unsigned>(d + 10));
        const Points source = numbers.landmarks(d, 7);
        Points target = source + 0.3 * numbers(d, 7);
        if (mirrored) target.row(0) *= -1;
        const Alignment best = align(source, target, kind);
        EXPECT_NEAR(best.rotation.determinant(), 1, 1e-14);
        EXPECT_GT(best.scale, 0);
        // On a line no positive scale is best for a mirrored shape: the sum falls down to scale 0.
        const bool has_best_scale = kind == AlignmentKind::kSimilarity && !(d == 1 && mirrored);
        const double sum = (best.apply(source) - target).squaredNorm();
        for (int trial = 0; trial < 20; ++trial) {
          Alignment other = best;
          other.translation += 1e-3 * numbers(d, 1);
          if (kind != AlignmentKind::kTranslation) other.rotation = small_rotation(numbers, d) * other.rotation;
          if (has_best_scale) other.scale *= 1 + 1e-3 * numbers();
          // The change of rotation or scale must not move the middle.
          other.translation += best.apply(source.rowwise().mean()) -
                               (other.scale * other.rotation * source.rowwise().mean() + best.translation);
          EXPECT_GE((other.apply(source) - target).squaredNorm(), sum);
        }
      }
    }
  }
}

TEST(Alignment, OfOneLandmarkIsATranslation) {
  const Points source = Eigen::Vector2d(1, 2);
  const Points target = Eigen::Vector2d(4, 6);
  for (const AlignmentKind kind : {AlignmentKind::kTranslation, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
    const Alignment found = align(source, target, kind);
    EXPECT_EQ(found.scale, 1) << alignment_name(kind);
    EXPECT_LE((found.apply(source) - target).norm(), 1e-14) << alignment_name(kind);
  }
}

// The message of the InputError that registering throws, checked to be one line.
std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }
  return "no error";
}

Landmarks square(const std::string& source) {
  Landmarks shape;
  shape.points = (Points(2, 4) << 0, 1, 1, 0, 0, 0, 1, 1).finished();
  shape.source = source;
  return shape;
}

std::string error_of(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options = {}) {
  return error_of([&] { register_shapes(source, target, options); });
}
// The error where `change` alters the default options.
template <class Change>
std::string error_with(const Change& change) {
  RegistrationOptions options;
  change(options);
  return error_of(square("a.csv"), square("b.csv"), options);
}

TEST(RegistrationErrors, NameShapesThatDoNotFit) {
  const Landmarks good = square("a.csv");
  Landmarks bad = square("b.csv");
  bad.points = Points::Random(2, 3);
  EXPECT_EQ(error_of(good, bad), "the shapes have different numbers of landmarks: a.csv has 4, b.csv has 3");
  bad.points = Points::Random(3, 4);
  EXPECT_EQ(error_of(good, bad), "the shapes have different dimensions: a.csv is 2D, b.csv is 3D");
  bad.points.resize(2, 0);
  EXPECT_EQ(error_of(bad, bad), "b.csv: the shape has no landmarks");
  bad.points = Points::Random(4, 4);
  EXPECT_EQ(error_of(bad, bad), "b.csv: landmarks in 4 dimensions; 1, 2 or 3 are supported");
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    bad = square("b.csv");
    bad.points(1, 2) = value;
    EXPECT_EQ(error_of(good, bad), "b.csv: landmark 3 has a coordinate that is not a finite number");
    bad.labels = {"nose", "chin", "left eye", "right eye"};
    EXPECT_EQ(error_of(bad, good), "b.csv: landmark 'left eye' has a coordinate that is not a finite number");
  }
}

TEST(RegistrationErrors, NameLandmarksAtOnePlace) {
  Landmarks twice = square("a.csv");
  twice.points.col(2) = twice.points.col(1);
  EXPECT_THAT(error_of(twice, square("b.csv")), AllOf(HasSubstr("a.csv: landmarks 2 and 3 are at the same place"),
                                                      HasSubstr("remove or move one of them, in the target too")));
  twice.labels = {"nose", "chin", "left eye", "right eye"};
  EXPECT_THAT(error_of(twice, square("b.csv")), HasSubstr("landmarks 'chin' and 'left eye' are at the same place"));
  Landmarks closed = square("a.csv");
  closed.points.col(3) = closed.points.col(0);
  EXPECT_THAT(error_of(closed, square("b.csv")),
              AllOf(HasSubstr("landmarks 1 and 4"), HasSubstr("a closed outline needs its first point only once")));
  EXPECT_EQ(error_of(square("b.csv"), closed), "no error") << "a target may have coinciding landmarks";
}

TEST(RegistrationErrors, NameNumbersOutOfRange) {
  for (const double value : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(error_with([&](auto& options) { options.sigma = value; }),
                AllOf(HasSubstr("sigma is"), HasSubstr("greater than 0")));
    EXPECT_THAT(error_with([&](auto& options) { options.lambda = value; }),
                AllOf(HasSubstr("lambda is"), HasSubstr("greater than 0")));
    EXPECT_THAT(error_with([&](auto& options) { options.grid.time = value; }),
                AllOf(HasSubstr("time is"), HasSubstr("greater than 0")));
  }
  EXPECT_EQ(error_with([](auto& options) { options.grid.steps = 0; }), "steps is 0; at least 1 is needed");
  EXPECT_EQ(error_with([](auto& options) { options.grid.steps = -3; }), "steps is -3; at least 1 is needed");
  Landmarks one = square("a.csv");
  one.points.conservativeResize(2, 1);
  RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.lambda.reset();
  EXPECT_EQ(error_of(one, one, options), "lambda auto needs at least two landmarks apart; give a number");
  EXPECT_THAT(error_of(one, one), HasSubstr("alpha=auto needs at least two landmarks apart"));
}

TEST(RegistrationErrors, NameWhatIsUnknown) {
  EXPECT_EQ(error_of([] { parse_mode("mapp"); }), "unknown mode 'mapp'; valid: deterministic, map");
  EXPECT_EQ(error_of([] { parse_alignment("affine"); }),
            "unknown alignment 'affine'; valid: none, translation, rigid, similarity");
  EXPECT_EQ(error_of([] { parse_solver("adam"); }), "unknown solver 'adam'; valid: auto, gauss-newton, lbfgs");
  EXPECT_THAT(error_with([](auto& options) { options.kernel = "gausian"; }),
              AllOf(HasSubstr("unknown kernel 'gausian'"), HasSubstr("'gaussian'")));
  EXPECT_THAT(error_with([](auto& options) { options.noise = "chsd:beta=1"; }),
              AllOf(HasSubstr("unknown noise 'chsd'"), HasSubstr("valid: none")));
  EXPECT_THAT(error_with([](auto& options) { options.integrator = "euler"; }),
              HasSubstr("unknown integrator 'euler'; valid: variational"));
  EXPECT_EQ(error_with([](auto& options) { options.noise = "ch-sd:beta=1,on=5"; }),
            "noise 'ch-sd:beta=1,on=5': on=5 names a landmark beyond the last; the shape has 4");
  EXPECT_EQ(error_with([](auto& options) { options.mode = MatchingMode::kMap; }),
            "mode map fits the noise, and there is none; give one, as in --noise ch-sd:beta=1");
}

TEST(RegistrationErrors, ObjectiveRefusesWhatDoesNotFit) {
  const Points q = square("").points;
  Points twice = q;
  twice.col(2) = twice.col(1);
  const auto error = [](const Points& source, const Points& target) {
    return error_of([&] {
      MatchingObjective({{make_kernel("gaussian:alpha=1", source), make_noise("none")},
                         make_integrator("variational"),
                         {},
                         source,
                         target});
    });
  };
  EXPECT_EQ(error(q, q), "no error");
  EXPECT_NE(error(twice, q), "no error");
  EXPECT_NE(error(q, q.leftCols(3)), "no error");
}

}  // namespace
}  // namespace pulson
