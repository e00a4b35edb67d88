// tps: curves, outlines and what else a shape carries; writing.

#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"
#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

using TpsFields = ReadingFiles;
using TpsCurves = ReadingFiles;
using TpsWriter = ReadingFiles;

TEST_F(TpsFields, AreKept) {
  const LandmarkFile file = read("a.tps",
                                 "LM = 1\r\n1 2\r\n\r\nIMAGE=C:\\fish\\b 1.jpg\r\nComment=x=1 \r\nSCALE=0,5\r\n"
                                 "VARIABLES=Area=25.750\r\nSEX=f\r\nLM=1\r\n3 4\r\nSCALE=\r\n");
  const Landmarks& shape = file.shapes.front();
  EXPECT_EQ(shape.points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(shape.name, "b 1");
  EXPECT_EQ(shape.image, "C:\\fish\\b 1.jpg");
  EXPECT_EQ(shape.scale, 0.5);
  EXPECT_THAT(shape.properties,
              ElementsAre(Pair("Comment", "x=1"), Pair("VARIABLES", "Area=25.750"), Pair("SEX", "f")));
  EXPECT_EQ(file.shapes[1].scale, std::nullopt);
  EXPECT_THAT(file.shapes[1].properties, IsEmpty());
  EXPECT_THAT(
      file.warnings,
      ElementsAre("a.tps: SCALE (1 of 2 shapes) is kept and not applied: coordinates are in pixels; `applies_scale` "
                  "multiplies them by it"));
}

TEST_F(TpsFields, MayHaveDecimalCommas) {
  EXPECT_EQ(read_one("a.tps", "LM=2\n1,5 2,5\n-,25 3,0e2\n").points, points_2d({1.5, 2.5, -0.25, 300}));
  EXPECT_EQ(read_error("a.tps", "LM=1\n1, 2\n"), "a.tps:2: landmark 1 of shape 1: x is '1,'; a number is needed");
  EXPECT_EQ(read_error("a.tps", "LM=1\n1,000.5 2\n"),
            "a.tps:2: landmark 1 of shape 1: x is '1,000.5'; a number is needed");
  EXPECT_EQ(read_error("a.tps", "LM=1\n1,2,3 2\n"), "a.tps:2: landmark 1 of shape 1: x is '1,2,3'; a number is needed");
}

TEST_F(TpsCurves, AreKept) {
  const LandmarkFile file =
      read("a.tps", "LM3=1\n1 2 3\nOUTLINES=1\nPOINTS=1\n9 9 9\nCURVES=2\nPOINTS=1\n7 8 9\nPOINTS=2\n1 1 1\n2 2 NA\n");
  const Landmarks& shape = file.shapes.front();
  ASSERT_EQ(shape.curves.size(), 2U);
  EXPECT_EQ(shape.curves[0], Eigen::Vector3d(7, 8, 9));
  EXPECT_TRUE(have_same_bits(shape.curves[1], (Points(3, 2) << 1, 2, 1, 2, 1, kNone).finished()));
  ASSERT_EQ(shape.outlines.size(), 1U);
  EXPECT_EQ(shape.outlines[0], Eigen::Vector3d(9, 9, 9));
  EXPECT_THAT(
      file.warnings,
      ElementsAre(
          "a.tps: 2 curves and 1 outline (4 points) are kept and not used as landmarks; `curve_points = N` takes N "
          "points of each"));
}

TEST_F(TpsCurves, AreTheLandmarksWhereThereAreNoOthers) {
  const LandmarkFile file =
      read("a.tps", "LM=0\nCURVES=2\nPOINTS=1\n1 2\nPOINTS=2\n3 4\n5 6\nOUTLINES=1\nPOINTS=1\n7 8\nID=A\nLM=1\n0 0\n");
  const Landmarks& shape = file.shapes.front();
  EXPECT_EQ(shape.points, points_2d({1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_THAT(shape.groups, ElementsAre("curve 1", "curve 2", "curve 2", "outline 1"));
  EXPECT_THAT(shape.curves, IsEmpty());
  EXPECT_THAT(shape.outlines, IsEmpty());
  EXPECT_THAT(file.shapes[1].groups, IsEmpty());
  EXPECT_THAT(file.warnings, ElementsAre("a.tps: 1 shape without landmarks: the points of curves and outlines are "
                                         "taken as landmarks, one group for each"));
}

TEST_F(TpsCurves, AreKeptAsTheyAreWhereTheCountsDiffer) {
  const LandmarkFile fewer = read("a.tps", "LM=1\n1 2\nCURVES=2\nPOINTS=1\n7 8\nLM=1\n3 4\n");
  ASSERT_EQ(fewer.shapes.size(), 2U);
  EXPECT_EQ(fewer.shapes[0].curves.size(), 1U);
  EXPECT_EQ(fewer.shapes[1].points, Eigen::Vector2d(3, 4));
  EXPECT_EQ(
      fewer.warnings.front(),
      "a.tps:3: shape 1 says 'CURVES=2' but has 1 list of POINTS=; the landmarks and the curves present are read");
  const LandmarkFile more =
      read("a.tps", "LM=1\n1 2\nOUTLINES=1\nPOINTS=1\n7 8\nPOINTS=1\n7 8\nLM=1\n1 2\nPOINTS=1\n7 8\n");
  EXPECT_EQ(more.shapes[0].outlines.size(), 2U);
  EXPECT_EQ(more.shapes[1].curves.size(), 1U);
  EXPECT_EQ(more.warnings.front(),
            "a.tps:3: shape 1 says 'OUTLINES=1' but has 2 lists of POINTS=; the landmarks and the curves present are "
            "read (1 more likewise)");
}

TEST_F(TpsCurves, AreRefusedWhereTheCountsOfLandmarksDiffer) {
  EXPECT_EQ(read_error("a.tps", "LM=0\nCURVES=2\nPOINTS=1\n7 8\nLM=1\n1 2\n"),
            "a.tps:2: shape 1 says 'CURVES=2' but has 1 list of POINTS=");
  EXPECT_EQ(read_error("a.tps", "LM=0\nPOINTS=1\n7 8\n"),
            "a.tps:3: shape 1 has 1 list of POINTS= that no CURVES= or OUTLINES= announces");
  EXPECT_EQ(read_error("a.tps", "LM=1\n1 2\nCURVES=1\nPOINTS=1\n7 8 9\n"),
            "a.tps:5: landmark 1 of curve 1 of shape 1 has 3 columns ('7 8 9'); LM= takes 2");
  EXPECT_EQ(read_error("a.tps", "LM=1\n1 2\nCURVES=4000000000\nPOINTS=4000000000\n7 8\n"),
            "a.tps:4: shape 1 says 'POINTS=4000000000' but has 1 line of coordinates before the file ends");
}

// ---- writing

TEST_F(TpsWriter, TellsThatCurvesAloneAreReadAsLandmarks) {
  LandmarkFile file;
  file.shapes.resize(2);
  for (Landmarks& shape : file.shapes) shape.curves = {points_2d({1, 2, 3, 4})};
  file.shapes[0].points.resize(2, 0);
  file.shapes[1].points = points_2d({5, 6});
  EXPECT_THAT(write_landmark_file("a.tps", file),
              ElementsAre("a.tps: tps cannot hold curves and outlines of a shape without landmarks "
                          "(1 of 2 shapes)"));
  EXPECT_EQ(read_landmark_file("a.tps").shapes[0].points, points_2d({1, 2, 3, 4}));
}

TEST_F(TpsWriter, WritesAllFields) {
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  shape.points = points_2d({0.1, -2, kNone, kNone});
  shape.name = "fish 1";
  shape.image = "b.jpg";
  shape.scale = 0.25;
  shape.properties = {{"COMMENT", "caught = yes"}, {"VARIABLES", "Area=3"}};
  shape.curves = {points_2d({1, 2, 3, 4})};
  shape.outlines = {points_2d({5, 6})};
  file.shapes.emplace_back().points = Eigen::Vector3d(1, 2, 3);
  EXPECT_THAT(write_landmark_file("a.tps", file), IsEmpty());
  EXPECT_EQ(contents("a.tps"),
            "LM=2\n0.1 -2\nNA NA\nCURVES=1\nPOINTS=2\n1 2\n3 4\nOUTLINES=1\nPOINTS=1\n5 6\nIMAGE=b.jpg\nID=fish 1\n"
            "COMMENT=caught = yes\nVARIABLES=Area=3\nSCALE=0.25\nLM3=1\n1 2 3\n");
}

TEST_F(TpsWriter, IsReadBackToTheSameBits) {
  LandmarkFile file;
  for (const int d : {2, 3, 2}) {
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = hard_points(d, 300);
    shape.points.col(7).setConstant(kNone);
    shape.points(0, 8) = kNone;
    shape.name = "shape " + std::to_string(file.shapes.size());
    shape.image = "some image.png";
    shape.scale = std::numeric_limits<double>::denorm_min();
    shape.properties = {{"COMMENT", "first"}, {"COMMENT", "second"}, {"SEX", ""}};
    shape.curves = {hard_points(d, 10), hard_points(d, 4)};
    shape.outlines = {hard_points(d, 5)};
  }
  EXPECT_THAT(write_landmark_file("a.tps", file), IsEmpty());
  const LandmarkFile back = read_landmark_file("a.tps");
  ASSERT_EQ(back.shapes.size(), file.shapes.size());
  for (std::size_t i = 0; i < file.shapes.size(); ++i) {
    const Landmarks& shape = file.shapes[i];
    const Landmarks& other = back.shapes[i];
    EXPECT_TRUE(have_same_bits(other.points, shape.points));
    EXPECT_EQ(other.name, shape.name);
    EXPECT_EQ(other.image, shape.image);
    EXPECT_EQ(other.scale, shape.scale);
    EXPECT_EQ(other.properties, shape.properties);
    ASSERT_EQ(other.curves.size(), 2U);
    EXPECT_TRUE(have_same_bits(other.curves[1], shape.curves[1]));
    ASSERT_EQ(other.outlines.size(), 1U);
    EXPECT_TRUE(have_same_bits(other.outlines[0], shape.outlines[0]));
  }
}

TEST_F(TpsWriter, SaysOnceWhatItCannotHold) {
  LandmarkFile file;
  file.units = "mm";
  file.axes = "LPS";
  for (int i = 0; i < 2; ++i) {
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = points_2d({1, 2, 3, 4});
    shape.labels = {"tip", "base"};
    shape.groups = {"a", "b"};
    shape.properties = {{"LM", "7"}, {"COMMENT", "two\nlines"}};
  }
  EXPECT_THAT(
      write_landmark_file("a.tps", file),
      ElementsAre(
          "a.tps: tps cannot hold labels (2 of 2 shapes)", "a.tps: tps cannot hold groups (2 of 2 shapes)",
          "a.tps: tps cannot hold the units 'mm'", "a.tps: tps cannot hold the axes 'LPS'",
          "a.tps: tps cannot hold line breaks and outer blanks of texts",
          "a.tps: tps cannot hold properties whose names are empty, hold '=', or are keywords or comments of tps"));
  EXPECT_EQ(contents("a.tps"), "LM=2\n1 2\n3 4\nCOMMENT=two lines\nLM=2\n1 2\n3 4\nCOMMENT=two lines\n");
}

TEST_F(TpsWriter, WritesNoPropertyThatWouldBeReadAsAnotherThing) {
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  shape.points = points_2d({1, 2, 3, 4});
  for (const std::string name : {"", " ", "LM3 ", "\tID", "a=b", "# a", "\"a\"", "'"}) {
    SCOPED_TRACE(name);
    shape.properties = {{name, "1"}, {"SEX", "f"}};
    EXPECT_THAT(write_landmark_file("a.tps", file),
                testing::Contains(
                    "a.tps: tps cannot hold properties whose names are empty, hold '=', or are keywords or comments "
                    "of tps"));
    EXPECT_EQ(contents("a.tps"), "LM=2\n1 2\n3 4\nSEX=f\n");
  }
  shape.properties = {{" body\nside ", "left"}};
  EXPECT_THAT(write_landmark_file("a.tps", file),
              ElementsAre("a.tps: tps cannot hold line breaks and outer blanks of texts"));
  EXPECT_EQ(contents("a.tps"), "LM=2\n1 2\n3 4\nbody side=left\n");
}

TEST_F(TpsWriter, RefusesOtherDimensions) {
  LandmarkFile file;
  const auto error = [&] { return write_error("a.tps", file); };
  EXPECT_EQ(error(), "a.tps: there are no shapes to write");
  file.shapes.emplace_back().points = Points::Zero(1, 2);
  EXPECT_EQ(error(), "a.tps: tps holds shapes in 2D or 3D; the shape is in 1D");
  file.shapes.front().points = Points::Zero(2, 2);
  file.shapes.front().curves = {Points::Zero(3, 1)};
  EXPECT_EQ(
      error(),
      "a.tps: tps holds curves and outlines of the dimension of the landmarks, which are in 2D; here is one in 3D");
}

}  // namespace
}  // namespace pulson::formats
