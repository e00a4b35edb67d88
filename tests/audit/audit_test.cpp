// What is planted in sound shapes is found and named; sound shapes are not accused.

#include "audit/audit.hpp"

#include <cmath>
#include <functional>
#include <optional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::audit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<Landmarks> leaves() {
  return formats::read_landmark_file(PULSON_SOURCE_DIR "/sample_shapes/leaves.tps").shapes;
}

/// An outline with a bump, disturbed smoothly: no rotation brings it onto its mirror image.
Landmarks outline(int seed, int count = 24) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  const double a = 0.05 * normal(random), b = 0.05 * normal(random), c = 0.05 * normal(random);
  Landmarks shape;
  shape.points.resize(2, count);
  for (int k = 0; k < count; ++k) {
    const double t = 2 * M_PI * k / count;
    const double r = 1 + a * std::cos(2 * t) + b * std::sin(3 * t) + 0.6 * std::exp(-4 * std::pow(t - 1.1, 2));
    shape.points.col(k) << 1.7 * r * std::cos(t + c) + 0.003 * normal(random), r * std::sin(t) + 0.003 * normal(random);
  }
  shape.source = "shape.csv#" + std::to_string(seed);
  return shape;
}

Landmarks with_points(Landmarks shape, const Points& points) {
  shape.points = points;
  return shape;
}

Landmarks exchanged(Landmarks shape, int a, int b) {
  shape.points.col(a).swap(shape.points.col(b));
  return shape;
}

Points begun_at(const Points& points, int begin) {
  Points moved = points;
  for (int k = 0; k < points.cols(); ++k) moved.col(k) = points.col((begin + k) % points.cols());
  return moved;
}

/// The only finding, if there is one alone.
std::optional<Finding> only(const Audit& audit) {
  if (audit.findings.size() != 1) return std::nullopt;
  return audit.findings.front();
}

TEST(AuditOfAPair, AccusesNoSoundShape) {
  const std::vector<Landmarks> sound = leaves();
  for (const Landmarks& a : sound)
    for (const Landmarks& b : sound) EXPECT_THAT(audit_pair(a, b).findings, IsEmpty()) << a.source << " " << b.source;
  for (int seed = 1; seed < 20; ++seed) EXPECT_THAT(audit_pair(outline(0), outline(seed)).findings, IsEmpty()) << seed;
}

TEST(AuditOfAPair, NamesExchangedLandmarks) {
  const std::vector<Landmarks> sound = leaves();
  for (const auto& [a, b] : {std::pair{9, 16}, {0, 5}, {3, 4}, {1, 18}}) {
    const auto found = only(audit_pair(sound[0], exchanged(sound[1], a, b)));
    ASSERT_TRUE(found) << a << " " << b;
    EXPECT_EQ(found->problem, Problem::kExchanged);
    EXPECT_THAT(found->landmarks, ElementsAre(a, b));
    EXPECT_LT(found->after, found->before);
    EXPECT_THAT(describe(*found, sound[1]),
                HasSubstr("landmarks " + std::to_string(a + 1) + " and " + std::to_string(b + 1) + " look exchanged"));
  }
}

TEST(AuditOfAPair, NamesOrdersOfOutlines) {
  for (int seed = 1; seed < 6; ++seed) {
    const Landmarks shape = outline(seed);
    const auto reversed = only(audit_pair(outline(0), with_points(shape, shape.points.rowwise().reverse())));
    ASSERT_TRUE(reversed);
    EXPECT_EQ(reversed->problem, Problem::kReversed);
    EXPECT_THAT(reversed->landmarks, ElementsAre(23));
    const auto turned = only(audit_pair(outline(0), with_points(shape, begun_at(shape.points.rowwise().reverse(), 7))));
    ASSERT_TRUE(turned);
    EXPECT_EQ(turned->problem, Problem::kReversed);
    EXPECT_THAT(turned->landmarks, ElementsAre(16));
    const auto shifted = only(audit_pair(outline(0), with_points(shape, begun_at(shape.points, 1))));
    ASSERT_TRUE(shifted);
    EXPECT_EQ(shifted->problem, Problem::kShifted);
    EXPECT_THAT(shifted->landmarks, ElementsAre(23));
  }
}

TEST(AuditOfAPair, NamesMirrorImagesAndPointsInNoOrder) {
  Landmarks shape = outline(3);
  shape.points.row(1) *= -1;
  const auto mirrored = only(audit_pair(outline(0), shape));
  ASSERT_TRUE(mirrored);
  EXPECT_EQ(mirrored->problem, Problem::kMirrored);
  std::mt19937 random(2);
  std::vector<int> order;
  for (int k = 0; k < 24; ++k) order.push_back(k);
  std::shuffle(order.begin(), order.end(), random);
  const auto unordered = only(audit_pair(outline(0), with_points(shape, outline(3).points(Eigen::all, order))));
  ASSERT_TRUE(unordered);
  EXPECT_EQ(unordered->problem, Problem::kUnordered);
}

TEST(AuditOfAPair, LeavesOutWhatIsMissing) {
  const std::vector<Landmarks> sound = leaves();
  Landmarks source = sound[0], target = exchanged(sound[1], 9, 16);
  source.points.col(2).setConstant(std::nan(""));
  target.points(0, 4) = std::nan("");
  const auto found = only(audit_pair(source, target));
  ASSERT_TRUE(found);
  EXPECT_THAT(found->landmarks, ElementsAre(9, 16));
}

TEST(AuditOfAPair, JudgesNeitherLinesNorFewLandmarks) {
  Landmarks line = outline(1), few = outline(1, 7);
  line.points = Points(line.points.row(0));
  EXPECT_THAT(audit_pair(line, exchanged(line, 1, 2)).findings, IsEmpty());
  EXPECT_THAT(audit_pair(few, exchanged(few, 1, 4)).findings, IsEmpty());
}

TEST(AuditOfACohort, NamesTheSpecimenAndWhatIsWrong) {
  std::vector<Landmarks> shapes;
  for (int seed = 0; seed < 12; ++seed) shapes.push_back(outline(seed));
  EXPECT_THAT(audit_cohort(shapes).findings, IsEmpty());
  shapes[2] = exchanged(shapes[2], 4, 11);
  shapes[5].points.row(0) *= -1;
  shapes[8].points *= 25.4;
  shapes[10].points = Points(shapes[10].points.rowwise().reverse());
  const std::vector<Finding> found = audit_cohort(shapes).findings;
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0].specimen, 2);
  EXPECT_EQ(found[0].problem, Problem::kExchanged);
  EXPECT_THAT(found[0].landmarks, ElementsAre(4, 11));
  EXPECT_EQ(found[1].specimen, 5);
  EXPECT_EQ(found[1].problem, Problem::kMirrored);
  EXPECT_EQ(found[2].specimen, 8);
  EXPECT_EQ(found[2].problem, Problem::kUnit);
  EXPECT_NEAR(found[2].factor, 25.4, 2);
  EXPECT_EQ(found[3].specimen, 10);
  EXPECT_EQ(found[3].problem, Problem::kReversed);
}

std::vector<Landmarks> outlines(int count) {
  std::vector<Landmarks> shapes;
  for (int seed = 0; seed < count; ++seed) shapes.push_back(outline(seed, 12));
  return shapes;
}

/// What is found where `spoil` spoils one of 20 outlines; nothing of the others.
std::vector<Finding> found_of(const std::function<void(Points&)>& spoil) {
  std::vector<Landmarks> shapes = outlines(20);
  spoil(shapes[6].points);
  std::vector<Finding> found = audit_cohort(shapes).findings;
  for (const Finding& finding : found) EXPECT_EQ(finding.specimen, 6) << describe(finding, shapes[6]);
  return found;
}

TEST(AuditOfACohort, NamesLandmarksThatMoved) {
  const Points sound = outline(6, 12).points;
  const auto moved = found_of([](Points& points) { points.col(3) += Eigen::Vector2d(0.2, 0.1); });
  ASSERT_EQ(moved.size(), 1U);
  EXPECT_EQ(moved[0].problem, Problem::kMoved);
  EXPECT_THAT(moved[0].landmarks, ElementsAre(3));
  EXPECT_TRUE(moved[0].corrected.col(3).array().isNaN().all());
  EXPECT_TRUE(moved[0].corrected.leftCols(3) == sound.leftCols(3));

  const auto typed = found_of([](Points& points) { points(0, 1) *= 10; });
  ASSERT_EQ(typed.size(), 1U);
  EXPECT_EQ(typed[0].slip, "x is 10 times too large");
  EXPECT_TRUE(typed[0].corrected.isApprox(sound));

  const auto sign = found_of([](Points& points) { points(1, 2) *= -1; });
  ASSERT_EQ(sign.size(), 1U);
  EXPECT_EQ(sign[0].slip, "y has the wrong sign");

  const auto coincident = found_of([](Points& points) { points.col(4) = points.col(7); });
  ASSERT_EQ(coincident.size(), 1U);
  EXPECT_THAT(coincident[0].landmarks, ElementsAre(4));
  EXPECT_THAT(coincident[0].slip, HasSubstr("coincides with landmark 8"));
}

TEST(AuditOfACohort, NamesCodesOfWhatIsMissing) {
  const auto zero = found_of([](Points& points) { points.col(3).setZero(), points.col(8).setZero(); });
  ASSERT_EQ(zero.size(), 1U);
  EXPECT_EQ(zero[0].problem, Problem::kZero);
  EXPECT_THAT(zero[0].landmarks, ElementsAre(3, 8));
  const auto nothing = found_of([](Points& points) { points.setZero(); });
  ASSERT_EQ(nothing.size(), 1U);
  EXPECT_EQ(nothing[0].problem, Problem::kUndigitised);
}

// Coordinates that begin at a landmark, as Bookstein's do.
TEST(AuditOfACohort, TakesNoOriginForACode) {
  std::vector<Landmarks> shapes = outlines(20);
  for (Landmarks& shape : shapes) shape.points.colwise() -= Eigen::VectorXd(shape.points.col(2));
  EXPECT_THAT(audit_cohort(shapes).findings, IsEmpty());
}

TEST(AuditOfACohort, NamesRunsAndWhatWasLeftOut) {
  const Points sound = outline(6, 12).points;
  const auto run =
      found_of([](Points& points) { points.middleCols(2, 5) = points.middleCols(2, 5).rowwise().reverse().eval(); });
  ASSERT_EQ(run.size(), 1U);
  EXPECT_EQ(run[0].problem, Problem::kReversed);
  EXPECT_THAT(run[0].landmarks, ElementsAre(2, 3, 4, 5, 6));
  EXPECT_TRUE(run[0].corrected == sound);

  const auto skipped = found_of([](Points& points) {
    points.middleCols(4, 7) = points.middleCols(5, 7).eval();
    points.col(11) *= 0.7;  // one more point, somewhere
  });
  ASSERT_EQ(skipped.size(), 1U);
  EXPECT_EQ(skipped[0].problem, Problem::kShifted);
  EXPECT_EQ(skipped[0].landmarks.size(), 8U);
  EXPECT_TRUE(skipped[0].corrected.col(4).array().isNaN().all());
  EXPECT_TRUE(skipped[0].corrected.rightCols(7) == sound.rightCols(7));
}

TEST(AuditOfACohort, TellsAxesFromMirrorImages) {
  const auto axes = found_of([](Points& points) { points.row(0).swap(points.row(1)); });
  ASSERT_EQ(axes.size(), 1U);
  EXPECT_EQ(axes[0].problem, Problem::kAxes);
  EXPECT_TRUE(axes[0].corrected == outline(6, 12).points);
  const auto mirrored = found_of([](Points& points) { points.row(1) *= -1; });
  ASSERT_EQ(mirrored.size(), 1U);
  EXPECT_EQ(mirrored[0].problem, Problem::kMirrored);
  EXPECT_TRUE(mirrored[0].corrected == outline(6, 12).points);
}

TEST(AuditOfACohort, TellsUnorderedPointsFromOtherShapes) {
  const auto unordered = found_of([](Points& points) {
    const std::vector<int> order = {5, 0, 9, 3, 11, 7, 2, 10, 6, 1, 8, 4};
    points = points(Eigen::all, order).eval();
  });
  ASSERT_EQ(unordered.size(), 1U);
  EXPECT_EQ(unordered[0].problem, Problem::kUnordered);
  const auto foreign = found_of([](Points& points) {
    for (int k = 0; k < 12; ++k) points.col(k) = 0.4 * Eigen::Vector2d(1 + k % 5, (k * k) % 7);
  });
  ASSERT_EQ(foreign.size(), 1U);
  EXPECT_EQ(foreign[0].problem, Problem::kForeign);
}

TEST(AuditOfACohort, NamesSeveralErrorsOfAShape) {
  const auto found = found_of([](Points& points) {
    points.col(1).swap(points.col(5));
    points.col(8) += Eigen::Vector2d(-0.2, 0.3);
  });
  ASSERT_EQ(found.size(), 2U);
  EXPECT_THAT((std::vector{found[0].problem, found[1].problem}),
              testing::UnorderedElementsAre(Problem::kExchanged, Problem::kMoved));
  EXPECT_TRUE(found[1].corrected.leftCols(8) == outline(6, 12).points.leftCols(8));
}

// Where most are wrong, little can be said, and nothing breaks: nor where a shape has hardly any landmark.
TEST(AuditOfACohort, JudgesWhatIsWrongThroughout) {
  for (const int sound : {0, 1, 2}) {
    std::vector<Landmarks> shapes = outlines(6);
    for (int i = sound; i < 6; ++i)
      shapes[static_cast<std::size_t>(i)] = exchanged(shapes[static_cast<std::size_t>(i)], 2 * i, 2 * i + 1);
    for (const Finding& finding : audit_cohort(shapes).findings) EXPECT_GE(finding.specimen, sound);
  }
  std::vector<Landmarks> shapes = outlines(9);
  for (int i = 1; i < 5; ++i) shapes[static_cast<std::size_t>(i)].points.rightCols(12 - i).setConstant(std::nan(""));
  EXPECT_THAT(audit_cohort(shapes).findings, IsEmpty());
}

// Sizes that differ as those of young and adult do are no other unit.
TEST(AuditOfACohort, AccusesNoGrowth) {
  std::vector<Landmarks> shapes;
  for (int seed = 0; seed < 12; ++seed) {
    shapes.push_back(outline(seed));
    shapes.back().points *= std::pow(1.25, seed);
  }
  EXPECT_THAT(audit_cohort(shapes).findings, IsEmpty());
}

}  // namespace
}  // namespace pulson::audit
