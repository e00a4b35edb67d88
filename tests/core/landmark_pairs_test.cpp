#include "core/landmark_pairs.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Names = std::vector<std::string>;

/// Landmark k of the file lies at (k, −k).
Landmarks counted_points(const std::string& source, int count) {
  Landmarks shape;
  shape.points.resize(2, count);
  shape.points.row(0) = Eigen::RowVectorXd::LinSpaced(count, 1, count);
  shape.points.row(1) = -shape.points.row(0);
  shape.source = source;
  return shape;
}

Landmarks labelled(const std::string& source, Names labels) {
  Landmarks shape = counted_points(source, static_cast<int>(labels.size()));
  shape.labels = std::move(labels);
  return shape;
}

Landmarks numbered(const std::string& source, std::vector<int> numbers) {
  Landmarks shape = counted_points(source, static_cast<int>(numbers.size()));
  shape.numbers = std::move(numbers);
  return shape;
}

TEST(LandmarkPairs, FollowLabels) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  Landmarks other = labelled("b.csv", {"ear", "nose", "chin"});
  other.groups = {"side", "front", "front"};
  Names notes;
  const Landmarks paired = in_order_of(first, other, notes);
  EXPECT_EQ(paired.points, (Points{{2.0, 3.0, 1.0}, {-2.0, -3.0, -1.0}}));
  EXPECT_EQ(paired.labels, first.labels);
  EXPECT_THAT(paired.groups, ElementsAre("front", "front", "side"));
  EXPECT_THAT(notes,
              ElementsAre("b.csv: its landmarks are in a different order from those of a.csv; they are paired by "
                          "their labels"));
}

TEST(LandmarkPairs, LeaveOutWhatOneSideHasAlone) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear", "eye"});
  const Landmarks other = labelled("b.csv", {"nose", "brow", "eye", "ear", "lip"});
  Names notes;
  const LandmarkPairs pairs = pair_landmarks(first, other, notes);
  EXPECT_THAT(pairs.first, ElementsAre(0, 2, 3));
  EXPECT_THAT(pairs.other, ElementsAre(0, 3, 2));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("a different order"),
                                 "a.csv: 1 of 4 landmarks is not in b.csv and is left out: 'chin'",
                                 "b.csv: 2 of 5 landmarks are not in a.csv and are left out: 'brow', 'lip'"));
  const Landmarks filled = in_order_of(first, other, notes);
  EXPECT_EQ(filled.count(), 4);
  EXPECT_TRUE(std::isnan(filled.points(0, 1)));
  EXPECT_EQ(filled.points(0, 2), 4);
}

TEST(LandmarkPairs, FollowTheNumbersOfFiles) {
  Names notes;
  const LandmarkPairs pairs =
      pair_landmarks(numbered("a.csv", {1, 2, 3, 5, 6}), numbered("b.csv", {1, 3, 4, 5}), notes);
  EXPECT_THAT(pairs.first, ElementsAre(0, 2, 3));
  EXPECT_THAT(pairs.other, ElementsAre(0, 1, 3));
  EXPECT_THAT(notes, ElementsAre("a.csv: 2 of 5 landmarks are not in b.csv and are left out: 2, 6",
                                 "b.csv: 1 of 4 landmarks is not in a.csv and is left out: 4"));
  // Labels that are numbers belong with numbers.
  notes.clear();
  EXPECT_THAT(pair_landmarks(labelled("a.csv", {"2", "1"}), numbered("b.csv", {1, 2, 3}), notes).other,
              ElementsAre(1, 0));
}

TEST(LandmarkPairs, FollowTheOrderWhereNothingElsePairs) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  for (const Names& labels :
       {Names{"nose", "chin", "ear"}, {"F-1", "F-2", "F-3"}, {"ear", "ear", "nose"}, {"ear", "", "nose"}}) {
    Names notes;
    EXPECT_THAT(pair_landmarks(first, labelled("b.csv", labels), notes).other, ElementsAre(0, 1, 2));
    EXPECT_THAT(notes, IsEmpty());
  }
  Names notes;
  EXPECT_THAT(pair_landmarks(first, labelled("b.csv", {"left", "nose", "right"}), notes).other, ElementsAre(0, 1, 2));
  EXPECT_THAT(notes, ElementsAre("a.csv and b.csv: the landmark 'nose' is in different positions and most other labels "
                                 "differ; landmarks are paired by their order"));
}

TEST(LandmarkPairs, NeedAsManyWhereNothingPairsThem) {
  Names notes;
  const auto error_with = [&](const Landmarks& other) {
    return error_of([&] { pair_landmarks(labelled("a.csv", {"x", "y", "z"}), other, notes); });
  };
  EXPECT_THAT(error_with(counted_points("b.csv", 4)),
              HasSubstr("a.csv has 3, b.csv has 4; both need the same landmarks, or labels or numbers"));
  EXPECT_THAT(
      error_with(labelled("b.csv", {"F-1", "F-2", "F-3", "F-4"})),
      HasSubstr("none of their labels are in both, and landmarks are paired by these only where half of the smaller"));
  EXPECT_THAT(error_with(labelled("b.csv", {"F-1", "F-2", "F-3", "y"})),
              HasSubstr("only 1 of their labels are in both"));
}

Landmarks in_frame(const std::string& source, const std::string& axes, const std::string& units) {
  Landmarks shape;
  shape.points = Points{{1.0}, {2.0}, {3.0}};
  shape.curves = {shape.points};
  shape.source = source;
  shape.axes = axes;
  shape.units = units;
  return shape;
}

TEST(CoordinateFrames, AreThoseOfTheOther) {
  Names notes;
  const Landmarks turned = in_frame_of(in_frame("b.fcsv", "LPS", "mm"), in_frame("a.fcsv", "RAS", "um"), notes);
  EXPECT_LE((turned.points - Points{{-0.001}, {-0.002}, {0.003}}).norm(), 1e-18);
  EXPECT_EQ(turned.curves.front(), turned.points);
  EXPECT_EQ(turned.axes, "LPS");
  EXPECT_EQ(turned.units, "mm");
  EXPECT_THAT(notes,
              ElementsAre("a.fcsv: its axes are RAS, those of b.fcsv LPS; converted by changing the signs of x and y",
                          "a.fcsv: its unit of length is um, that of b.fcsv mm; converted"));
}

TEST(CoordinateFrames, AreLeftAloneWhereOneIsNotKnown) {
  for (const auto& [frame, shape] : {std::pair{in_frame("b", "", ""), in_frame("a", "RAS", "mm")},
                                     {in_frame("b", "LPS", "mm"), in_frame("a", "", "")},
                                     {in_frame("b", "LPS", "mm"), in_frame("a", "LPS", "mm")}}) {
    Names notes;
    EXPECT_EQ(in_frame_of(frame, shape, notes).points, shape.points);
    EXPECT_THAT(notes, IsEmpty());
  }
  Names notes;
  EXPECT_EQ(error_of([&] { in_frame_of(in_frame("b.txt", "", "voxels"), in_frame("a.fcsv", "RAS", "mm"), notes); }),
            "a.fcsv: its coordinates are in mm, those of b.txt in voxels; both need the same unit");
}

TEST(CoincidentLandmarks, AreListedAndMerged) {
  Landmarks shape;
  shape.points = (Points(2, 5) << 0, 1, 0, 1, 0, 0, 0, 0, 1, 0).finished();
  shape.source = "a.csv";
  EXPECT_THAT(coincident_pairs(shape.points),
              testing::UnorderedElementsAre(std::pair(0, 2), std::pair(0, 4), std::pair(2, 4)));
  EXPECT_TRUE(is_repeated(shape.points, 0, 4));
  EXPECT_FALSE(is_repeated(shape.points, 0, 1));
  EXPECT_EQ(merged_note(shape, 0, 4, "in both shapes"),
            "a.csv: landmarks 1 and 5 are at the same position in both shapes and are merged: a closed outline");
  const Landmarks one = merged(shape, 1, 3, {3, 1});
  ASSERT_EQ(one.count(), 4);
  EXPECT_EQ(one.points.col(1), Eigen::Vector2d(1, 0.25));
  EXPECT_EQ(one.number(3), 5);
  shape.points(0, 1) = std::nan("");
  EXPECT_TRUE(is_repeated(shape.points, 1, 0));
  EXPECT_EQ(merged(shape, 1, 3, {3, 1}).points.col(1), Eigen::Vector2d(1, 1));
  shape.points(0, 3) = std::nan("");
  EXPECT_TRUE(merged(shape, 1, 3, {1, 1}).points.col(1).hasNaN());
}

TEST(LandmarkPairs, KeepLinksBetweenTheLandmarksThatStay) {
  Landmarks shape = labelled("a.csv", {"nose", "chin", "ear", "eye"});
  shape.links = {{0, 1}, {1, 2}, {2, 3}};
  using testing::Pair;
  EXPECT_THAT(selected(shape, {3, 2, 0}).links, ElementsAre(Pair(1, 0)));
  EXPECT_THAT(merged(shape, 0, 1, {1, 1}).links, ElementsAre(Pair(0, 1), Pair(1, 2))) << "those of the second landmark";
  Names notes;
  EXPECT_EQ(in_order_of(shape, labelled("b.csv", {"eye", "ear", "chin"}), notes).links, shape.links);
}

}  // namespace
}  // namespace pulson
