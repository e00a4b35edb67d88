// What ReadOptions ask: a format, columns, landmarks, points of curves, scales.

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Reading : public ReadingFiles {
 protected:
  static Landmarks read_with(const ReadOptions& options, const std::string& name, const std::string& text) {
    write(name, text);
    return read_landmarks(name, nullptr, options);
  }

  static std::string error_with(const ReadOptions& options, const std::string& name, const std::string& text) {
    write(name, text);
    return error_of([&] { read_addressed_shapes(name, options); });
  }
};

using ReadFormat = Reading;
using ReadColumns = Reading;
using ReadInTurn = Reading;
using ReadLandmarks = Reading;
using ReadCurves = Reading;
using ReadScale = Reading;

// ---- format

TEST_F(ReadFormat, MayBeNamed) {
  const std::string text = "1 2\n3 4\n";
  EXPECT_EQ(read_with({.format = "csv"}, "a.tps", text).points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(error_with({.format = "tps"}, "a.csv", text), "a.csv:1: '1 2'; a tps file begins with LM= or LM3=");
  EXPECT_THAT(error_with({.format = "tsp"}, "a.csv", text),
              HasSubstr("'tsp' is not a landmark format; did you mean 'tps'; valid: npy, "));
}

// ---- columns

TEST_F(ReadColumns, HaveTheNamesThatAreGiven) {
  const std::string table = "id,he_col,he_row,label,x\nA,1,2,tip,9\nB,3,4,eye,9\n";
  const Landmarks shape =
      read_with({.columns = {{"x", "he_col"}, {"y", "he_row"}, {"name", "label"}}}, "he.csv", table);
  EXPECT_EQ(shape.points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(shape.labels, ElementsAre("tip", "eye"));
  EXPECT_EQ(read_with({.columns = {{"x", "HE col"}, {"y", "he_row"}}}, "he.csv", "x,he_col,he_row\n9,1,2\n").points,
            Eigen::Vector2d(1, 2));
  EXPECT_EQ(read_with({.columns = {{"x", "a"}, {"y", "b"}, {"z", "c"}}}, "a.tsv", "b\tc\ta\n2\t3\t1\n").points,
            Eigen::Vector3d(1, 2, 3));
}

TEST_F(ReadColumns, MayTellSpecimensAndGroupsApart) {
  write("a.csv", "who,u,v,part\na,1,2,k\na,3,4,l\nb,5,6,k\nb,7,8,l\n");
  const LandmarkFile file =
      read_landmark_file("a.csv", {.columns = {{"x", "u"}, {"y", "v"}, {"specimen", "who"}, {"group", "part"}}});
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[1].name, "b");
  EXPECT_EQ(file.shapes[1].points, points_2d({5, 6, 7, 8}));
  EXPECT_THAT(file.shapes[1].groups, ElementsAre("k", "l"));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(ReadColumns, AreListedWhereOneIsNotThere) {
  EXPECT_EQ(error_with({.columns = {{"x", "he_co"}, {"y", "he_row"}}}, "he.csv", "id,he_col,he_row\n1,2,3\n"),
            "he.csv:1: no column 'he_co', did you mean 'he_col'?; the columns are 'id', 'he_col', 'he_row'");
  EXPECT_EQ(error_with({.columns = {{"x", "he_col"}, {"y", "he_col"}}}, "he.csv", "id,he_col\n1,2\n"),
            "he.csv:1: the column 'he_col' cannot hold both x and y");
  EXPECT_EQ(error_with({.columns = {{"x", "a"}}}, "a.csv", "1,2\n3,4\n"),
            "a.csv:1: the first line names no columns: '1', '2'; a header is needed");
}

TEST_F(ReadColumns, AreOfTablesAlone) {
  write("a.tps", "LM=1\n1 2\n");
  const LandmarkFile file = read_landmark_file("a.tps", {.columns = {{"x", "a"}}});
  EXPECT_EQ(file.shapes[0].points, Eigen::Vector2d(1, 2));
  EXPECT_THAT(file.warnings, ElementsAre("a.tps: it is not a table but tps; the names of columns are not used"));
}

TEST_F(ReadInTurn, TakesTheCoordinatesOfOneColumn) {
  const std::string numbers = "1\n2\n3\n4\n5\n6\n";
  EXPECT_EQ(read_with({.dimension = 2}, "a.txt", numbers).points, points_2d({1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(read_with({.dimension = 3}, "a.txt", "value\n" + numbers).points,
            (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_EQ(read_with({.dimension = 2}, "a.csv", "x,y\n1,2\n").points, Eigen::Vector2d(1, 2)) << "has two columns";
  EXPECT_EQ(error_with({.dimension = 2}, "a.txt", "1\n2\n3\n"),
            "a.txt:3: 3 numbers in one column; with 2 coordinates for each landmark a multiple of 2 is needed");
  EXPECT_EQ(error_with({.dimension = 2}, "a.txt", "1\n2\n3\nb\n"), "a.txt:4: landmark 2: y is 'b'; a number is needed");
}

// ---- a choice of landmarks

TEST_F(ReadLandmarks, AreThoseOfTheList) {
  const std::string tps = "LM=5\n1 1\n2 2\n3 3\n4 4\n5 5\n";
  const Landmarks shape = read_with({.landmarks = "5, 1-2"}, "a.tps", tps);
  EXPECT_EQ(shape.points, points_2d({5, 5, 1, 1, 2, 2}));
  EXPECT_THAT(shape.numbers, ElementsAre(5, 1, 2));
  const std::string table = "label,x,y\ntip,1,1\n3,2,2\nleft-eye,3,3\n";
  const Landmarks labelled = read_with({.landmarks = "left-eye,3,1"}, "a.csv", table);
  EXPECT_EQ(labelled.points, points_2d({3, 3, 2, 2, 1, 1})) << "a label goes before a number";
  EXPECT_THAT(labelled.labels, ElementsAre("left-eye", "3", "tip"));
}

TEST_F(ReadLandmarks, AreThoseOfARangeInItsDirection) {
  const std::string tps = "LM=5\n1 1\n2 2\n3 3\n4 4\n5 5\n";
  EXPECT_THAT(read_with({.landmarks = "3-1,4-4,5"}, "a.tps", tps).numbers, ElementsAre(3, 2, 1, 4, 5));
  const std::string table = "label,x,y\nS-1,1,1\nS-2,2,2\nS-3,3,3\ntip,4,4\n";
  EXPECT_THAT(read_with({.landmarks = "S-1-S-3"}, "a.csv", table).labels, ElementsAre("S-1", "S-2", "S-3"));
  EXPECT_THAT(read_with({.landmarks = "tip - S-2,S-1"}, "a.csv", table).labels,
              ElementsAre("tip", "S-3", "S-2", "S-1"));
}

TEST_F(ReadLandmarks, AreChosenInTheShapesThatAreWanted) {
  const std::string tps = "LM=1\n1 1\nID=a\nLM=2\n2 2\n3 3\nID=b\n";
  write("a.tps", tps);
  EXPECT_EQ(read_landmarks("a.tps#2", nullptr, {.landmarks = "2"}).points, Eigen::Vector2d(3, 3));
  EXPECT_EQ(error_of([] { read_landmark_file("a.tps", {.landmarks = "2"}); }),
            "a.tps#1 has no landmark 2; they are numbered from 1 to 1");
}

TEST_F(ReadLandmarks, AreRefusedWhereTheyAreNotThere) {
  const std::string table = "label,x,y\ntip,1,1\neye,2,2\nfin,3,3\n";
  const auto error = [&](const std::string& list) { return error_with({.landmarks = list}, "a.csv", table); };
  EXPECT_EQ(error("1-20"), "a.csv has no landmark 4; they are numbered from 1 to 3");
  EXPECT_EQ(error("0"), "a.csv has no landmark 0; they are numbered from 1 to 3");
  EXPECT_EQ(error("tipp"), "a.csv has no landmark 'tipp'; did you mean 'tip'?");
  EXPECT_EQ(error("1,,2"), "a.csv has no landmark ''; a label, a number or a range such as 1-20 is expected");
  EXPECT_EQ(error("tip-fins"),
            "a.csv has no landmark 'tip-fins'; a label, a number or a range such as 1-20 is expected");
  EXPECT_EQ(error("1-2,tip"), "a.csv: landmark 'tip' is in the list of landmarks twice");
  EXPECT_EQ(error_with({.landmarks = "a"}, "a.tps", "LM=1\n1 2\n"),
            "a.tps has no landmark 'a'; it has no labels, and a number or a range such as 1-20 is expected");
}

// ---- points of curves

TEST_F(ReadCurves, AreAtEqualDistances) {
  const Landmarks shape = read_with({.curve_points = 4}, "a.tps",
                                    "LM=2\n9 9\n8 8\nCURVES=1\nPOINTS=4\n0 0\n1 0\n1 0\n3 0\nOUTLINES=1\nPOINTS=4\n"
                                    "0 0\n2 0\n2 2\n0 2\nSCALE=0.5\n");
  EXPECT_EQ(shape.points, points_2d({9, 9, 8, 8, 0, 0, 1, 0, 2, 0, 3, 0, 0, 0, 2, 0, 2, 2, 0, 2}));
  EXPECT_THAT(std::vector<std::string>(shape.groups.begin(), shape.groups.begin() + 2), Each("landmarks"));
  EXPECT_THAT(std::vector<std::string>(shape.groups.begin() + 2, shape.groups.begin() + 6), Each("curve 1"));
  EXPECT_THAT(std::vector<std::string>(shape.groups.begin() + 6, shape.groups.end()), Each("outline 1"));
  EXPECT_THAT(shape.curves, IsEmpty());
  EXPECT_THAT(shape.outlines, IsEmpty());
}

TEST_F(ReadCurves, LieOnACircleToTheAccuracyOfItsPolygon) {
  constexpr int kVertices = 2000, kPoints = 17;
  std::string text = "LM=0\nOUTLINES=1\nPOINTS=" + std::to_string(kVertices) + "\n";
  for (int i = 0; i < kVertices; ++i) {  // not evenly: denser where the angle is small
    const double angle = 2 * std::numbers::pi * std::pow(i / double{kVertices}, 1.5);
    text += std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + "\n";
  }
  const Landmarks shape = read_with({.curve_points = kPoints}, "a.tps", text);
  ASSERT_EQ(shape.count(), kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    EXPECT_NEAR(shape.points(0, i), std::cos(angle), 1e-4);
    EXPECT_NEAR(shape.points(1, i), std::sin(angle), 1e-4);
  }
}

TEST_F(ReadCurves, ReplaceThoseThatAreTheLandmarks) {
  write("a.tps", "LM=0\nCURVES=1\nPOINTS=2\n0 0\n3 0\nID=a\n");
  const LandmarkFile file = read_landmark_file("a.tps", {.curve_points = 4});
  EXPECT_EQ(file.shapes[0].points, points_2d({0, 0, 1, 0, 2, 0, 3, 0}));
  EXPECT_THAT(file.shapes[0].groups, Each("curve 1"));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(ReadCurves, FollowTheLandmarksThatAreChosen) {
  const Landmarks shape = read_with({.landmarks = "2", .curve_points = 2}, "a.tps",
                                    "LM=3\n9 9\n8 8\n7 7\nCURVES=1\nPOINTS=3\n0 0\nNA NA\n3 0\n");
  EXPECT_EQ(shape.points, points_2d({8, 8, 0, 0, 3, 0}));
  EXPECT_THAT(shape.numbers, ElementsAre(2, 3, 4));
}

TEST_F(ReadCurves, AreRefusedWithoutLength) {
  EXPECT_EQ(error_with({.curve_points = 2}, "a.tps", "LM=1\n9 9\nCURVES=1\nPOINTS=1\n0 0\n"),
            "a.tps: curve 1 cannot be resampled: it has no length");
  EXPECT_EQ(error_with({.curve_points = 2}, "a.tps", "LM=1\n9 9\n"),
            "a.tps has no curves or outlines to take points from");
}

// ---- scales

TEST_F(ReadScale, MultipliesCoordinates) {
  write("a.tps", "LM=1\n2 4\nCURVES=1\nPOINTS=1\n6 8\nSCALE=0.5\n");
  const LandmarkFile file = read_landmark_file("a.tps", {.applies_scale = true});
  EXPECT_EQ(file.shapes[0].points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(file.shapes[0].curves[0], Eigen::Vector2d(3, 4));
  EXPECT_FALSE(file.shapes[0].scale);
  EXPECT_THAT(file.warnings, ElementsAre("a.tps: 1 curve and 0 outlines (1 point) are kept and not used as landmarks; "
                                         "`curve_points = N` takes N points of each"));
}

TEST_F(ReadScale, MayHaveAUnit) {
  write("m.txt",
        "<shapes type=list>\n<scaling.units >mm</scaling.units>\n<scaling >0.5</scaling>\n<landmarks.pixel "
        "type=matrix>\n2 4\n</landmarks.pixel>\n</shapes>\n");
  const LandmarkFile file = read_landmark_file("m.txt", {.applies_scale = true});
  EXPECT_EQ(file.shapes[0].points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(file.units, "mm");
  EXPECT_EQ(file.shapes[0].units, "mm");
}

TEST_F(ReadScale, IsNeededOfEachShape) {
  EXPECT_EQ(error_with({.applies_scale = true}, "a.tps", "LM=1\n1 2\nSCALE=2\nLM=1\n1 2\n"),
            "a.tps#2 has no scale to multiply its coordinates by");
  EXPECT_EQ(error_with({.applies_scale = true}, "a.tps", "LM=1\n1 2\nSCALE=-2\n"),
            "a.tps: its scale is -2; a number greater than 0 is needed");
  EXPECT_EQ(error_with({.applies_scale = true}, "a.tps", "LM=1\n1e200 2\nSCALE=1e200\n"),
            "a.tps: its coordinates are too large to be multiplied by its scale, 1e+200");
}

}  // namespace
}  // namespace pulson::formats
