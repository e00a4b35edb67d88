#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cohort_examples.hpp"
#include "combinations.hpp"
#include "error_of.hpp"
#include "numbers.hpp"
#include "pulson/compare/cohort_fit.hpp"
#include "pulson/compare/comparison.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::HasSubstr;

// A turn by the angles given, in the plane of each pair of axes.
MatrixXd turn(Index d, double angle) {
  MatrixXd whole = MatrixXd::Identity(d, d);
  for (Index b = 1; b < d; ++b)
    for (Index a = 0; a < b; ++a) {
      MatrixXd one = MatrixXd::Identity(d, d);
      one(a, a) = one(b, b) = std::cos(angle);
      one(b, a) = std::sin(angle);
      one(a, b) = -std::sin(angle);
      whole *= one;
    }
  return whole;
}

Points moved(const Points& points, double scale, double angle, double shift) {
  return ((scale * turn(points.rows(), angle) * points).colwise() + VectorXd::Constant(points.rows(), shift));
}

// Copies of a shape of which each is a motion of the first.
struct Copies {
  explicit Copies(int d) : shape(Numbers(3 + static_cast<unsigned>(d)).landmarks(d, 6)) {
    // The first is bare, so that the mean is to lie as `shape`.
    for (const double scale : {1.0, 0.8, 1.5}) {
      shapes.push_back(named_shape(moved(shape, scale, scale - 1, 2 * (scale - 1))));
      size += scale * centroid_size(shape) / 3;
    }
  }
  Points shape;
  std::vector<Landmarks> shapes;
  double size = 0;
};

class InDimension : public testing::TestWithParam<Index> {};
INSTANTIATE_TEST_SUITE_P(All, InDimension, testing::Values(1, 2, 3));

TEST_P(InDimension, TheMeanOfMotionsOfOneShapeIsThatShape) {
  const Copies copies(static_cast<int>(GetParam()));
  const Landmarks mean = procrustes_mean(copies.shapes, AlignmentKind::kSimilarity);
  EXPECT_NEAR(centroid_size(mean.points), copies.size, 1e-9);
  const VectorXd middle = copies.shape.rowwise().mean();
  const Points expected = ((copies.shape.colwise() - middle) * (copies.size / centroid_size(copies.shape))).colwise() +
                          middle;  // it lies as the first
  EXPECT_LE((mean.points - expected).norm(), 1e-8);
}

TEST_P(InDimension, ALandmarkThatOneShapeMissesIsTakenFromTheOthers) {
  Copies copies(static_cast<int>(GetParam()));
  for (const std::size_t of : {std::size_t{0}, std::size_t{1}}) {
    std::vector<Landmarks> shapes = copies.shapes;
    for (Landmarks& each : shapes) each.points = moved(copies.shape, 1, each.points(0, 0), 1);
    const Points first = shapes.front().points;
    shapes[of].points(0, 2) = kNaN;
    const Landmarks mean = procrustes_mean(shapes, AlignmentKind::kRigid);
    EXPECT_LE((mean.points - first).norm(), 1e-8) << of;
  }
}

TEST(CentroidSize, IsThatOfTheLandmarksThatAreComplete) {
  Points points(2, 4);
  points << 0, 2, 0, 9, 0, 0, 2, std::numeric_limits<double>::quiet_NaN();
  EXPECT_NEAR(centroid_size(points), std::sqrt(16.0 / 3), 1e-12);
  EXPECT_NEAR(centroid_size(10 * points), 10 * std::sqrt(16.0 / 3), 1e-12);
}

TEST(ProcrustesMean, ByNoMotionIsThePlainMean) {
  Points first = Eigen::RowVector3d(0, 1, 2);
  const Points second = Eigen::RowVector3d(1, 3, 8);
  first(0, 2) = kNaN;
  const Landmarks mean = procrustes_mean({named_shape(first), named_shape(second)}, AlignmentKind::kNone);
  EXPECT_EQ(mean.points, Points(Eigen::RowVector3d(0.5, 2, 8)));
  EXPECT_EQ(mean.source, "mean of 2 shapes");
}

// Of shapes that differ in more than a motion, the mean is a fixed point: the mean of the shapes moved onto it.
TEST(ProcrustesMean, RestsWhereTheShapesMovedOntoItHaveItAsTheirMean) {
  Numbers numbers(4);
  const Points shape = numbers.landmarks(2, 7);
  std::vector<Landmarks> shapes;
  for (int s = 0; s < 5; ++s)
    shapes.push_back(named_shape(moved(shape + 0.1 * numbers(2, 7), 1 + 0.1 * s, 0.4 * s, s)));
  const Points mean = procrustes_mean(shapes, AlignmentKind::kRigid).points;
  Points sum = Points::Zero(2, 7);
  for (const Landmarks& each : shapes) sum += align(each.points, mean, AlignmentKind::kRigid).apply(each.points);
  EXPECT_LE((sum / 5 - mean).norm(), 1e-8);
}

TEST(ProcrustesMean, Refuses) {
  const Landmarks shape = oval(4);
  Landmarks holed = shape;
  holed.points(1, 2) = kNaN;
  holed.source = "b.csv";
  const auto mean = [](const std::vector<Landmarks>& shapes, AlignmentKind kind) {
    return error_of([&] { procrustes_mean(shapes, kind); });
  };
  for (const AlignmentKind kind : {AlignmentKind::kNone, AlignmentKind::kSimilarity})
    EXPECT_THAT(mean({holed, holed}, kind), HasSubstr("landmark 3 is missing in every shape"));
  EXPECT_THAT(mean({shape, oval(5)}, AlignmentKind::kRigid), HasSubstr("oval.csv has 4 landmarks in 2D"));
  EXPECT_THAT(mean({shape, shape}, AlignmentKind::kAffine), HasSubstr("use similarity"));
  EXPECT_THAT(mean({}, AlignmentKind::kNone), HasSubstr("no shapes"));
}

TEST(MakeCohort, MovesTheTargetsOntoTheSourceWhateverTheyMiss) {
  const Landmarks source = oval(6);
  Landmarks target = named_shape(moved(source.points, 1.7, 0.8, 3));
  target.points(0, 4) = kNaN;
  const Cohort cohort = make_cohort(source, {target}, AlignmentKind::kSimilarity);
  for (const Index a : {0, 1, 2, 3, 5})
    EXPECT_LE((cohort.targets.front().points.col(a) - source.points.col(a)).norm(), 1e-9);
  EXPECT_TRUE(std::isnan(cohort.targets.front().points(0, 4)));
  EXPECT_EQ(make_cohort(source, {source}, AlignmentKind::kNone).targets.front().points, source.points);
}

TEST(MakeCohort, Refuses) {
  const Landmarks source = oval(4);
  Landmarks holed = source;
  holed.points(0, 1) = kNaN;
  const auto made = [](const Landmarks& about, const std::vector<Landmarks>& targets) {
    return error_of([&] { make_cohort(about, targets, AlignmentKind::kNone); });
  };
  EXPECT_THAT(made(source, {}), HasSubstr("there is no target"));
  EXPECT_THAT(made(source, {source, oval(5)}), HasSubstr("4 landmarks in 2D, oval.csv has 5 in 2D"));
  EXPECT_THAT(made(source, {named_shape(Points::Zero(3, 4))}), HasSubstr("a.csv has 4 in 3D"));
  EXPECT_THAT(made(holed, {source}), HasSubstr("oval.csv: landmark 2 has a missing coordinate"));
  EXPECT_EQ(made(source, {holed}), "no error");
}

std::vector<Index> all_coordinates(const Points& points) {
  std::vector<Index> all;
  for (Index i = 0; i < points.size(); ++i) all.push_back(i);
  return all;
}

TEST_P(InDimension, MotionDirectionsAreOrthonormalAndAsManyAsTheMotions) {
  const auto d = static_cast<int>(GetParam());
  const Points shape = Numbers(8).landmarks(d, 6);
  const std::vector<std::pair<AlignmentKind, Index>> counts = {{AlignmentKind::kNone, 0},
                                                               {AlignmentKind::kTranslation, d},
                                                               {AlignmentKind::kRigid, d + d * (d - 1) / 2},
                                                               {AlignmentKind::kSimilarity, d + d * (d - 1) / 2 + 1},
                                                               {AlignmentKind::kAffine, d + d * d}};
  std::vector<Index> some = all_coordinates(shape);
  some.erase(some.begin() + 2);
  for (const auto& [kind, count] : counts)
    for (const std::vector<Index>& observed : {all_coordinates(shape), some}) {
      const MatrixXd basis = motion_directions(shape, kind, observed);
      EXPECT_EQ(basis.rows(), std::ssize(observed));
      ASSERT_EQ(basis.cols(), count) << alignment_name(kind);
      if (count > 0) {
        EXPECT_LE((basis.transpose() * basis - MatrixXd::Identity(count, count)).norm(), 1e-12);
      }
    }
}

// Motions that are no more than others where the shape is degenerate: landmarks of a line in the plane.
TEST(MotionDirections, AreFewerWhereMotionsDoTheSame) {
  Points line = Points::Zero(2, 5);
  line.row(0) = Eigen::RowVectorXd::LinSpaced(5, 0, 1);
  EXPECT_EQ(motion_directions(line, AlignmentKind::kSimilarity, all_coordinates(line)).cols(), 4);
  EXPECT_EQ(motion_directions(line, AlignmentKind::kAffine, all_coordinates(line)).cols(), 4);
}

// What a small motion changes lies in their span but for a rest of second order.
TEST_P(InDimension, MotionDirectionsSpanSmallMotions) {
  const Points shape = Numbers(9).landmarks(static_cast<int>(GetParam()), 6);
  const std::vector<Index> all = all_coordinates(shape);
  const auto rest = [&](AlignmentKind kind, const Points& after) {
    const MatrixXd basis = motion_directions(shape, kind, all);
    const VectorXd change = (after - shape).reshaped();
    return (change - basis * (basis.transpose() * change)).norm();
  };
  Numbers numbers(10);
  const MatrixXd sheared = numbers(GetParam(), GetParam());
  std::vector<double> sizes, rigid;
  for (const double e : {0.02, 0.01, 0.005}) {
    EXPECT_LE(rest(AlignmentKind::kTranslation, moved(shape, 1, 0, e)), 1e-14);
    EXPECT_LE(rest(AlignmentKind::kSimilarity, moved(shape, 1 + e, 0, e)), 1e-14);
    EXPECT_LE(rest(AlignmentKind::kAffine, moved(shape + e * sheared * shape, 1, 0, e)), 1e-14);
    sizes.push_back(e);
    rigid.push_back(rest(AlignmentKind::kRigid, moved(shape, 1, e, e)));
    if (GetParam() > 1) {
      EXPECT_GT(rest(AlignmentKind::kRigid, moved(shape, 1 + e, 0, 0)), 0.1 * e);
    }
  }
  if (GetParam() > 1) {
    EXPECT_NEAR(fitted_order(sizes, rigid), 2, 0.05);
  }
}

// The last point of each oval repeats its first.
Landmarks closed_oval(double width, const std::string& source) {
  Landmarks shape = oval(8);
  shape.points.row(0) *= width;
  shape.points.conservativeResize(2, 9);
  shape.points.col(8) = shape.points.col(0);
  shape.source = source;
  return shape;
}

TEST(CoincidentInACohort, AreOneWhereAllShapesHaveThemSo) {
  CohortShapes shapes{{}, {closed_oval(1, "a.csv"), closed_oval(1.2, "b.csv"), closed_oval(1.3, "c.csv")}};
  shapes.targets[1].points(0, 8) = std::nan("");
  shapes.targets[2].points.col(4) = shapes.targets[2].points.col(3);  // of one shape only
  std::vector<std::string> notes;
  merge_coincident(shapes, false, notes);
  EXPECT_EQ(notes,
            (std::vector<std::string>{
                "a.csv: landmarks 1 and 9 are at the same position in all shapes and are merged: a closed outline"}));
  for (const Landmarks& shape : shapes.targets) EXPECT_EQ(shape.count(), 8);
  EXPECT_EQ(shapes.targets[0].points, oval(8).points);
  EXPECT_TRUE(shapes.targets[1].points.allFinite());
  EXPECT_FALSE(find_coincident(shapes.cohort().source.points));
}

TEST(CoincidentInACohort, AreMergedWhereATargetHasThemApartAndItIsAskedFor) {
  CohortShapes shapes{closed_oval(1, "a.csv"), {closed_oval(1.2, "b.csv"), closed_oval(1.3, "c.csv")}};
  shapes.targets[1].points.col(8) += Eigen::Vector2d(0.1, 0.2);
  std::vector<std::string> notes;
  EXPECT_THAT(error_of([&] { merge_coincident(shapes, false, notes); }),
              AllOf(HasSubstr("a.csv: landmarks 1 and 9 are at the same position, but apart in c.csv"),
                    HasSubstr("`merge_coincident`")));
  merge_coincident(shapes, true, notes);
  EXPECT_EQ(notes.size(), 1U);
  EXPECT_EQ(shapes.source->points, oval(8).points);
  EXPECT_NEAR(shapes.targets[1].points(0, 0), 1.35, 1e-15);
  EXPECT_NEAR(shapes.targets[1].points(1, 0), 0.1, 1e-15);
}

// Three at one place count alike in the mean.
TEST(CoincidentInACohort, CountAlikeInTheMean) {
  CohortShapes shapes{oval(6), {oval(6)}};
  for (const int a : {2, 5}) shapes.source->points.col(a) = shapes.source->points.col(1);
  std::vector<std::string> notes;
  merge_coincident(shapes, true, notes);
  ASSERT_EQ(shapes.source->count(), 4);
  const Points& q = oval(6).points;
  EXPECT_LT((shapes.targets[0].points.col(1) - (q.col(1) + q.col(2) + q.col(5)) / 3).norm(), 1e-15);
}

}  // namespace
}  // namespace pulson::compare
