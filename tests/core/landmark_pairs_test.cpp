#include "core/landmark_pairs.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/shape_frames.hpp"
#include "error_of.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

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

TEST(LandmarkPairs, KeepWhichLandmarksAreAbsent) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear", "eye"});
  Landmarks other = labelled("b.csv", {"eye", "ear", "nose"});
  other.points.col(1).setConstant(std::nan(""));
  other.absent = {1};
  Names notes;
  const Landmarks paired = in_order_of(first, other, notes);
  EXPECT_THAT(paired.absent, ElementsAre(2));
  EXPECT_THAT(missing_landmarks(paired), ElementsAre(1)) << "the other has no chin: it is not known to be absent";
  EXPECT_THAT(selected(paired, {3, 2}).absent, ElementsAre(1));
  EXPECT_THAT(merged(paired, 2, 3, {1, 1}).absent, IsEmpty()) << "one of the two is there";
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

TEST(LandmarkPairs, FollowTheOrderWhereNeitherHasNamesOrTheUserSaysSo) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  for (const auto& [one, two] :
       {std::pair{counted_points("a.csv", 3), counted_points("b.csv", 3)},
        {first, labelled("b.csv", {"nose", "chin", "ear"})},
        {labelled("a.csv", {"leaf", "leaf", "leaf"}), labelled("b.csv", {"tip", "tip", "tip"})},
        {labelled("a.csv", {"ear", "ear", "nose"}), labelled("b.csv", {"ear", "ear", "nose"})}}) {
    Names notes;
    EXPECT_THAT(pair_landmarks(one, two, notes).other, ElementsAre(0, 1, 2));
    EXPECT_THAT(notes, IsEmpty());
  }
  Names notes;
  const Landmarks other = labelled("b.csv", {"left", "nose", "right"});
  EXPECT_THAT(pair_landmarks(first, other, notes, PairBy::kOrder).other, ElementsAre(0, 1, 2));
  EXPECT_EQ(in_order_of(first, other, notes, PairBy::kOrder).labels, first.labels);
  EXPECT_THAT(error_of([&] { pair_landmarks(first, counted_points("b.csv", 4), notes, PairBy::kOrder); }),
              HasSubstr("a.csv has 3, b.csv has 4; pairs by order need as many"));
}

TEST(LandmarkPairs, ByNumbersCountThoseWithoutNames) {
  Names notes;
  EXPECT_THAT(pair_landmarks(labelled("a.csv", {"LM3", "LM1", "LM2"}), counted_points("b.tps", 3), notes).other,
              ElementsAre(2, 0, 1));
  EXPECT_THAT(pair_landmarks(counted_points("a.tps", 3), labelled("b.csv", {"2", "0", "1"}), notes).other,
              ElementsAre(1, 2, 0));
  EXPECT_THAT(pair_landmarks(numbered("a.csv", {1, 2, 4, 5}), counted_points("b.csv", 5), notes).other,
              ElementsAre(0, 1, 3, 4));
}

TEST(LandmarkPairs, OfSeveralOutlinesHaveTheNamesOfBoth) {
  Landmarks first = labelled("a.csv", {"nose", "tail", "nose", "tail"}), other = first;
  first.groups = {"mouse", "mouse", "rat", "rat"};
  other.groups = {"rat", "rat", "mouse", "mouse"};
  Names notes;
  EXPECT_THAT(pair_landmarks(first, other, notes).other, ElementsAre(2, 3, 0, 1));
}

// Names of one side alone contradict nothing, and are said.
TEST(LandmarkPairs, AreInOrderWhereOneSideHasNoNames) {
  Names notes;
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"}), other = counted_points("b.csv", 3);
  EXPECT_THAT(pair_landmarks(first, other, notes).other, ElementsAre(0, 1, 2));
  EXPECT_THAT(notes, ElementsAre("b.csv does not name its landmarks; they are paired with those of a.csv by their "
                                 "order"));
  notes.clear();
  EXPECT_THAT(pair_landmarks(other, first, notes).other, ElementsAre(0, 1, 2));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("b.csv does not name its landmarks")));
}

TEST(LandmarkPairs, AreRefusedWhereNamesDoNotSayWhichCorrespond) {
  Names notes;
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear", "eye"});
  const auto error_with = [&](const Landmarks& other) {
    return error_of([&] { pair_landmarks(first, other, notes); });
  };
  EXPECT_EQ(error_with(counted_points("b.csv", 5)),
            "a.csv names its landmarks ('nose', …), b.csv does not, so that nothing says which correspond; name them "
            "alike in both");
  EXPECT_EQ(error_with(labelled("b.csv", {"brow", "Nose", "lip", "jaw"})),
            "a.csv and b.csv: only 1 of the smaller shape's 4 landmarks has a partner of the same name, and at least "
            "half need one; without: 'chin', 'ear', 'eye' of a.csv; 'brow', 'lip', 'jaw' of b.csv; `by_order` pairs "
            "them in the order of the files");
  EXPECT_THAT(error_with(labelled("b.csv", {"F-1", "F-2", "F-3", "F-4"})), HasSubstr("none of the smaller shape's 4"));
  EXPECT_THAT(error_with(labelled("b.csv", {"NOSE", "Nose", "ear", "eye"})), HasSubstr("are alike"));
  EXPECT_THAT(error_of([&] {
                pair_landmarks(labelled("a.csv", {"0", "1", "2"}), numbered("b.csv", {1, 2, 3}), notes);
              }),
              HasSubstr("from 0 to 2, b.csv from 1 to 3"));
  EXPECT_THAT(error_of([&] { pair_landmarks(counted_points("a.csv", 3), counted_points("b.csv", 4), notes); }),
              HasSubstr("a.csv has 3, b.csv has 4; nothing says which of them correspond"));
}

TEST(LandmarkPairs, ListAllThatLackAPartner) {
  Names first_names, other_names;
  for (int i = 0; i < 20; ++i) {
    first_names.push_back("mark" + std::string(1, static_cast<char>('a' + i)));
    other_names.push_back(i < 12 ? first_names.back() : "other" + std::string(1, static_cast<char>('a' + i)));
  }
  Names notes;
  pair_landmarks(labelled("a.csv", first_names), labelled("b.csv", other_names), notes);
  ASSERT_EQ(notes.size(), 2U);
  for (int i = 12; i < 20; ++i) {
    EXPECT_THAT(notes[0], HasSubstr(first_names[static_cast<std::size_t>(i)]));
    EXPECT_THAT(notes[1], HasSubstr(other_names[static_cast<std::size_t>(i)]));
  }
}

TEST(UndigitisedShapes, HaveAllLandmarksAtOnePoint) {
  Landmarks shape = counted_points("a.csv", 4);
  EXPECT_FALSE(is_undigitised(shape));
  shape.points.setZero();
  EXPECT_TRUE(is_undigitised(shape));
  shape.points.setConstant(-1);
  EXPECT_TRUE(is_undigitised(shape));
  shape.points.setConstant(std::nan(""));
  EXPECT_TRUE(is_undigitised(shape));
  shape.points.col(2).setZero();
  EXPECT_FALSE(is_undigitised(shape));
  EXPECT_FALSE(is_undigitised(counted_points("a.csv", 1)));
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
