#include "pulson/core/alignment.hpp"

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <Eigen/QR>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/determined.hpp"
#include "error_of.hpp"
#include "numbers.hpp"
#include "random_numbers.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::array kFittedKinds = {AlignmentKind::kTranslation, AlignmentKind::kRigid, AlignmentKind::kSimilarity,
                                     AlignmentKind::kAffine};

// A random orthogonal matrix of this determinant.
MatrixXd orthogonal(Numbers& numbers, int d, double determinant) {
  MatrixXd q = Eigen::HouseholderQR<MatrixXd>(numbers(d, d)).householderQ();
  if (q.determinant() * determinant < 0) q.col(0) = -q.col(0);
  return q;
}

// A random motion of the kind; its determinant is positive, but negative for an affine or similar one that mirrors.
Alignment random_motion(Numbers& numbers, int d, AlignmentKind kind, bool mirrors = false) {
  Alignment motion{kind, 1, MatrixXd::Identity(d, d), VectorXd::Zero(d)};
  if (kind == AlignmentKind::kNone) return motion;
  motion.translation = 3 * numbers(d, 1);
  if (kind == AlignmentKind::kTranslation) return motion;
  motion.linear = orthogonal(numbers, d, mirrors ? -1 : 1);
  if (kind == AlignmentKind::kSimilarity) motion.scale = 2.5;
  if (kind == AlignmentKind::kAffine) {
    const MatrixXd x = numbers(d, d);
    motion.linear *= MatrixXd::Identity(d, d) + x * x.transpose();
  }
  return motion;
}

// The rotation by small angles: the Cayley transform of a skew matrix.
MatrixXd small_rotation(Numbers& numbers, int d) {
  const MatrixXd x = 1e-3 * numbers(d, d);
  const MatrixXd skew = x - x.transpose();
  return (MatrixXd::Identity(d, d) - skew).inverse() * (MatrixXd::Identity(d, d) + skew);
}

void expect_same(const Alignment& found, const Alignment& expected, double tolerance = 1e-13) {
  EXPECT_EQ(found.kind, expected.kind);
  EXPECT_NEAR(found.scale, expected.scale, tolerance * expected.scale);
  EXPECT_LE((found.linear - expected.linear).norm(), tolerance);
  EXPECT_LE((found.translation - expected.translation).norm(), 10 * tolerance);
}

std::string affine_error(const Points& source, const Points& target, const AlignmentOptions& options = {}) {
  return error_of([&] { align(source, target, AlignmentKind::kAffine, options); });
}

// Runs `check(d, kind, numbers)` for each kind that is fitted, in each dimension.
template <class Check>
void for_each_kind(const Check& check) {
  for (int d = 1; d <= 3; ++d) {
    for (const AlignmentKind kind : kFittedKinds) {
      SCOPED_TRACE(alignment_name(kind) + " in dimension " + std::to_string(d));
      Numbers numbers(static_cast<unsigned>(d + 10));
      check(d, kind, numbers);
    }
  }
}

TEST(Alignment, NamesAreReadBack) {
  EXPECT_EQ(parse_alignment("none"), AlignmentKind::kNone);
  EXPECT_EQ(parse_alignment("affine"), AlignmentKind::kAffine);
  for (const AlignmentKind kind : kFittedKinds) EXPECT_EQ(parse_alignment(alignment_name(kind)), kind);
}

TEST(Alignment, RecoversAMotion) {
  for_each_kind([](int d, AlignmentKind kind, Numbers& numbers) {
    const Points source = numbers.landmarks(d, 7);
    const Alignment motion = random_motion(numbers, d, kind);
    expect_same(align(source, motion.apply(source), kind), motion);
  });
  const Points source = Points::Random(2, 4);
  expect_same(align(source, 3 * source, AlignmentKind::kNone),
              {AlignmentKind::kNone, 1, MatrixXd::Identity(2, 2), VectorXd::Zero(2)}, 0);
}

// The best size of a source that has nothing to do with the target is nearly none, and nothing could be matched then.
TEST(Alignment, KeepsTheSizeOfUnrelatedShapes) {
  Numbers numbers(1);
  const Points source = numbers(2, 200), target = 3 * numbers(2, 200);
  const auto spread = [](const Points& x) { return (x.colwise() - x.rowwise().mean()).norm(); };
  const Alignment motion = align(source, target, AlignmentKind::kSimilarity);
  EXPECT_NEAR(motion.scale, spread(target) / spread(source), 1e-12);
}

TEST(Alignment, IsTheBestMotionAndNoReflection) {
  for (const bool mirrored : {false, true}) {
    for_each_kind([mirrored](int d, AlignmentKind kind, Numbers& numbers) {
      if (kind == AlignmentKind::kAffine) return;  // see AffineFitSolvesTheNormalEquations
      const Points source = numbers.landmarks(d, 7);
      Points target = source + 0.3 * numbers(d, 7);
      if (mirrored) target.row(0) *= -1;
      const VectorXd weights = numbers(7, 1).array() + 1.5;
      const auto sum = [&](const Alignment& motion) {
        return (motion.apply(source) - target).colwise().squaredNorm().dot(weights);
      };
      const Alignment best = align(source, target, kind, {weights});
      EXPECT_NEAR(best.linear.determinant(), 1, 1e-14);
      EXPECT_GT(best.scale, 0);
      // On a line no positive scale is best for a mirrored shape: the sum falls down to scale 0.
      const bool has_best_scale = kind == AlignmentKind::kSimilarity && !(d == 1 && mirrored);
      const VectorXd middle = source * weights / weights.sum();
      for (int trial = 0; trial < 20; ++trial) {
        Alignment other = best;
        if (kind != AlignmentKind::kTranslation) other.linear = small_rotation(numbers, d) * other.linear;
        if (has_best_scale) other.scale *= 1 + 1e-3 * numbers();
        // The change of rotation or scale must not move the middle.
        other.translation += best.apply(middle) - other.apply(middle) + 1e-3 * numbers(d, 1);
        EXPECT_GE(sum(other), sum(best));
      }
    });
  }
}

TEST(Alignment, AffineFitSolvesTheNormalEquations) {
  for (int d = 1; d <= 3; ++d) {
    Numbers numbers(static_cast<unsigned>(d));
    const Points source = numbers.landmarks(d, 9);
    const Points target = random_motion(numbers, d, AlignmentKind::kAffine).apply(source) + 0.1 * numbers(d, 9);
    const VectorXd weights = numbers(9, 1).array() + 1.5;
    const Points residual = align(source, target, AlignmentKind::kAffine, {weights}).apply(source) - target;
    EXPECT_GT(residual.norm(), 0.05);
    EXPECT_LE((residual * weights).norm(), 1e-12);
    EXPECT_LE((residual * weights.asDiagonal() * source.transpose()).norm(), 1e-12);
  }
}

TEST(Alignment, WeightCountsALandmarkSoManyTimes) {
  for_each_kind([](int d, AlignmentKind kind, Numbers& numbers) {
    const Points source = numbers.landmarks(d, 6);
    const Points target = source + 0.2 * numbers(d, 6);
    const std::vector<int> repeated = {0, 1, 1, 1, 2, 3, 4, 4, 5};
    const VectorXd weights = (VectorXd(6) << 1, 3, 1, 1, 2, 1).finished();
    const Alignment expected = align(source(Eigen::all, repeated), target(Eigen::all, repeated), kind);
    for (const double unit : {1.0, 1e-300, 4e307}) expect_same(align(source, target, kind, {unit * weights}), expected);
    EXPECT_GT((align(source, target, kind).apply(source) - expected.apply(source)).norm(), 1e-3);
  });
}

TEST(Alignment, LeavesOutWeightZeroAndWhatIsMissing) {
  for_each_kind([](int d, AlignmentKind kind, Numbers& numbers) {
    const Points source = numbers.landmarks(d, 8);
    const Points target = source + 0.2 * numbers(d, 8);
    const Alignment expected = align(source.leftCols(5), target.leftCols(5), kind);
    AlignmentOptions options{VectorXd::Ones(8)};
    options.weights[5] = 0;
    Points from = source;
    Points to = target;
    to.col(5).setConstant(1e6);
    from(d - 1, 6) = kNaN;
    to(0, 7) = kInfinity;
    expect_same(align(from, to, kind, options), expected, 0);
    options.weights[5] = 1;
    EXPECT_GT((align(from, to, kind, options).translation - expected.translation).norm(), 1);
  });
}

TEST(Alignment, ReflectsOnlyWhenAskedAndWhenThatFitsBetter) {
  for_each_kind([](int d, AlignmentKind kind, Numbers& numbers) {
    if (kind == AlignmentKind::kTranslation) return;
    const Points source = numbers.landmarks(d, 7);
    const Alignment mirror = random_motion(numbers, d, kind, true);
    const Alignment motion = random_motion(numbers, d, kind);
    expect_same(align(source, mirror.apply(source), kind, {{}, true}), mirror);
    expect_same(align(source, motion.apply(source), kind, {{}, true}), motion);
    if (kind == AlignmentKind::kAffine)
      EXPECT_THAT(affine_error(source, mirror.apply(source)),
                  AllOf(HasSubstr("determinant -"), HasSubstr("`reflect`")));
    else
      EXPECT_NEAR(align(source, mirror.apply(source), kind).linear.determinant(), 1, 1e-14);
  });
}

TEST(Alignment, RotatesWhatLiesOnALineOrAtOnePlace) {
  for (const double unit : {1e-90, 1.0, 1e90}) {
    const Points line = unit * (Points(2, 4) << 0.1, 0.2, 0.3, 0.7, 0.3, 0.6, 0.9, 2.1).finished();
    Numbers numbers(3);
    for (int trial = 0; trial < 10; ++trial) {
      const Points target = orthogonal(numbers, 2, trial % 2 == 0 ? 1 : -1) * line;
      const Alignment found = align(line, target, AlignmentKind::kRigid, {{}, true});
      EXPECT_NEAR(found.linear.determinant(), 1, 1e-14) << "a reflection fits no better";
      EXPECT_LE((found.apply(line) - target).norm(), 1e-14 * line.norm());
    }
    const Points place = unit * Eigen::Vector2d(0.1, 0.7).replicate(1, 3);
    for (const AlignmentKind kind : {AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
      for (const Points& target : {Points(line.leftCols(3)), Points(2 * place)}) {
        const Alignment found = align(place, target, kind);
        EXPECT_EQ(found.linear, MatrixXd::Identity(2, 2)) << alignment_name(kind);
        EXPECT_EQ(found.scale, 1) << alignment_name(kind);
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

TEST(AlignmentErrors, SayWhatAnAffineMapNeeds) {
  for (int d = 1; d <= 3; ++d) {
    Numbers numbers(static_cast<unsigned>(d));
    const Points source = numbers.landmarks(d, 6);
    const std::string need = "in " + std::to_string(d) + "D needs at least " + std::to_string(d + 1) + " landmarks";
    EXPECT_THAT(affine_error(source.leftCols(d), source.leftCols(d)),
                AllOf(HasSubstr(need), HasSubstr("of the source there are " + std::to_string(d))));
    AlignmentOptions options{VectorXd::Zero(6)};
    options.weights.head(d).setOnes();
    EXPECT_THAT(affine_error(source, source, options), HasSubstr(need));
    EXPECT_EQ(affine_error(source.leftCols(d + 1), source.leftCols(d + 1)), "no error");
    for (const double unit : {1e-90, 1.0, 1e90}) {
      // Moved far away, the rounding of its coordinates must not make a hyperplane a full space.
      Points flat = source;
      if (d > 1) flat.row(d - 1) = source.topRows(d - 1).colwise().sum() / 3;
      if (d == 1) flat.setConstant(0.1);
      flat = unit * (flat.array() + 1e4 / 3);
      EXPECT_THAT(affine_error(flat, unit * source),
                  AllOf(HasSubstr(need), HasSubstr("of the source there are 6, all in one hyperplane")));
      EXPECT_THAT(affine_error(unit * source, flat), HasSubstr("of the target there are 6, all in one hyperplane"));
      EXPECT_EQ(affine_error(unit * source, source), "no error");
    }
  }
}

TEST(AlignmentErrors, RefuseAnAffineMapThatFlattens) {
  const Points source = (Points(2, 4) << -1, 1, -1, 1, -1, -1, 1, 1).finished();
  const Points target = (Points(2, 4) << -1, 1, -1, 1, 1, -1, -1, 1).finished();  // y is xy
  for (const bool reflect : {false, true})
    EXPECT_THAT(affine_error(source, target, {{}, reflect}), HasSubstr("determinant 0"));
}

TEST(AlignmentErrors, NameWhatIsWrong) {
  const Points shape = Numbers(1).landmarks(2, 4);
  const auto error = [&](const VectorXd& weights, const Points& target) {
    return error_of([&] { align(shape, target, AlignmentKind::kTranslation, {weights}); });
  };
  EXPECT_EQ(error(VectorXd::Ones(3), shape), "there are 3 weights for 4 landmarks");
  for (const double wrong : {-1.0, kNaN, kInfinity})
    EXPECT_THAT(error(Eigen::Vector4d(1, 0, wrong, 1), shape),
                AllOf(HasSubstr("the weight of landmark 3 is"), HasSubstr("0 or greater")));
  EXPECT_THAT(error(VectorXd::Zero(4), shape), HasSubstr("no landmark can be aligned"));
  EXPECT_THAT(error({}, Points::Constant(2, 4, kNaN)), HasSubstr("no landmark can be aligned"));
}

TEST(AlignmentParameters, AreThoseOfTheGroups) {
  const std::map<AlignmentKind, std::array<int, 3>> kParameters = {{AlignmentKind::kNone, {0, 0, 0}},
                                                                   {AlignmentKind::kTranslation, {1, 2, 3}},
                                                                   {AlignmentKind::kRigid, {1, 3, 6}},
                                                                   {AlignmentKind::kSimilarity, {2, 4, 7}},
                                                                   {AlignmentKind::kAffine, {2, 6, 12}}};
  for (const auto& [kind, of_dimension] : kParameters)
    for (int d = 1; d <= 3; ++d)
      EXPECT_EQ(alignment_parameters(kind, d), of_dimension.at(static_cast<std::size_t>(d - 1))) << d;
}

// A map with as many parameters as there are coordinates fits them whatever they are.
TEST(Determined, NeedsMoreCoordinatesThanParameters) {
  Numbers numbers(3);
  for (int d = 1; d <= 3; ++d)
    for (const AlignmentKind kind : kFittedKinds) {
      const auto parameters = static_cast<int>(alignment_parameters(kind, d));
      const int enough = parameters / d + 1, all = enough + 2;
      const Points source = numbers.landmarks(d, all);
      Points target = numbers.landmarks(d, all);
      target.rightCols(all - enough).setConstant(std::nan(""));
      EXPECT_TRUE(is_determined(source, target, kind)) << d << alignment_name(kind);
      if (enough == 1) continue;
      VectorXd weights = VectorXd::Ones(all);
      weights[0] = 0;
      EXPECT_FALSE(is_determined(source, target, kind, weights)) << d << alignment_name(kind);
      target(0, 0) = std::nan("");
      EXPECT_FALSE(is_determined(source, target, kind)) << d << alignment_name(kind);
    }
}

TEST(Determined, NamesTheLikeliestRemedy) {
  Numbers numbers(4);
  const Points source = numbers.landmarks(2, 4);
  Points target = numbers.landmarks(2, 4);
  target.rightCols(2).setConstant(std::nan(""));
  EXPECT_EQ(error_of([&] { require_determined(source, target, AlignmentKind::kSimilarity, "b.csv"); }),
            "b.csv: the match is undetermined: alignment similarity has 4 parameters in 2D, no fewer than the 4 "
            "coordinates of the 2 landmarks observed in both shapes; use `align = translation`");
  target.col(1).setConstant(std::nan(""));
  EXPECT_EQ(error_of([&] { require_determined(source, target, AlignmentKind::kTranslation, "b.csv"); }),
            "b.csv: the match is undetermined: alignment translation has 2 parameters in 2D, no fewer than the 2 "
            "coordinates of the 1 landmark observed in both shapes; use `align = none`");
  require_determined(source, target, AlignmentKind::kNone, "b.csv");
}

TEST(Determined, AreShapesOfAProcrustesMean) {
  Numbers numbers(5);
  std::vector<Landmarks> shapes(3);
  for (Landmarks& shape : shapes) shape.points = numbers.landmarks(2, 4);
  shapes[1].points.rightCols(3).setConstant(std::nan(""));
  shapes[1].source = "b.csv";
  EXPECT_THAT(error_of([&] { procrustes_mean(shapes, AlignmentKind::kSimilarity); }),
              HasSubstr("b.csv: the match is undetermined"));
}

}  // namespace
}  // namespace pulson
