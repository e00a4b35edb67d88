// What is planted in sound shapes is found and named; sound shapes are not accused.

#include "audit/audit.hpp"

#include <cmath>
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

TEST(AuditOfAPair, AccusesNoSoundShape) {
  const std::vector<Landmarks> sound = leaves();
  for (const Landmarks& a : sound)
    for (const Landmarks& b : sound) EXPECT_FALSE(audit_pair(a, b)) << a.source << " " << b.source;
  for (int seed = 1; seed < 20; ++seed) EXPECT_FALSE(audit_pair(outline(0), outline(seed))) << seed;
}

TEST(AuditOfAPair, NamesExchangedLandmarks) {
  const std::vector<Landmarks> sound = leaves();
  for (const auto& [a, b] : {std::pair{9, 16}, {0, 5}, {3, 4}, {1, 18}}) {
    const auto found = audit_pair(sound[0], exchanged(sound[1], a, b));
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
    const auto reversed = audit_pair(outline(0), with_points(shape, shape.points.rowwise().reverse()));
    ASSERT_TRUE(reversed);
    EXPECT_EQ(reversed->problem, Problem::kReversed);
    EXPECT_THAT(reversed->landmarks, ElementsAre(23));
    const auto turned = audit_pair(outline(0), with_points(shape, begun_at(shape.points.rowwise().reverse(), 7)));
    ASSERT_TRUE(turned);
    EXPECT_EQ(turned->problem, Problem::kReversed);
    EXPECT_THAT(turned->landmarks, ElementsAre(16));
    const auto shifted = audit_pair(outline(0), with_points(shape, begun_at(shape.points, 1)));
    ASSERT_TRUE(shifted);
    EXPECT_EQ(shifted->problem, Problem::kShifted);
    EXPECT_THAT(shifted->landmarks, ElementsAre(23));
  }
}

TEST(AuditOfAPair, NamesMirrorImagesAndPointsInNoOrder) {
  Landmarks shape = outline(3);
  shape.points.row(1) *= -1;
  const auto mirrored = audit_pair(outline(0), shape);
  ASSERT_TRUE(mirrored);
  EXPECT_EQ(mirrored->problem, Problem::kMirrored);
  std::mt19937 random(2);
  std::vector<int> order;
  for (int k = 0; k < 24; ++k) order.push_back(k);
  std::shuffle(order.begin(), order.end(), random);
  const auto unordered = audit_pair(outline(0), with_points(shape, outline(3).points(Eigen::all, order)));
  ASSERT_TRUE(unordered);
  EXPECT_EQ(unordered->problem, Problem::kUnordered);
}

TEST(AuditOfAPair, LeavesOutWhatIsMissing) {
  const std::vector<Landmarks> sound = leaves();
  Landmarks source = sound[0], target = exchanged(sound[1], 9, 16);
  source.points.col(2).setConstant(std::nan(""));
  target.points(0, 4) = std::nan("");
  const auto found = audit_pair(source, target);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->landmarks, ElementsAre(9, 16));
}

TEST(AuditOfAPair, JudgesNeitherLinesNorFewLandmarks) {
  Landmarks line = outline(1), few = outline(1, 7);
  line.points = Points(line.points.row(0));
  EXPECT_FALSE(audit_pair(line, exchanged(line, 1, 2)));
  EXPECT_FALSE(audit_pair(few, exchanged(few, 1, 4)));
}

TEST(AuditOfACohort, NamesTheSpecimenAndWhatIsWrong) {
  std::vector<Landmarks> shapes;
  for (int seed = 0; seed < 12; ++seed) shapes.push_back(outline(seed));
  EXPECT_THAT(audit_cohort(shapes), IsEmpty());
  shapes[2] = exchanged(shapes[2], 4, 11);
  shapes[5].points.row(0) *= -1;
  shapes[8].points *= 25.4;
  shapes[10].points = Points(shapes[10].points.rowwise().reverse());
  const std::vector<Finding> found = audit_cohort(shapes);
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

// Sizes that differ as those of young and adult do are no other unit.
TEST(AuditOfACohort, AccusesNoGrowth) {
  std::vector<Landmarks> shapes;
  for (int seed = 0; seed < 12; ++seed) {
    shapes.push_back(outline(seed));
    shapes.back().points *= std::pow(1.25, seed);
  }
  EXPECT_THAT(audit_cohort(shapes), IsEmpty());
}

}  // namespace
}  // namespace pulson::audit
