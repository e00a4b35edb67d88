// tps: landmarks, names and what is refused; tps_test.cpp has the rest.

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
using testing::HasSubstr;
using testing::IsEmpty;

using TpsFile = ReadingFiles;

TEST_F(TpsFile, TakesEveryWayToWriteTheSamePair) {
  const std::vector<std::string> texts = {
      "LM=2\n1.5 -2\n300 0.25\nID=A\n",
      "LM=2\r\n1.5 -2\r\n300 0.25\r\nID=A\r\n",
      "lm = 2\n\n1.5\t-2 \n 300  .25\nId =  A ",
      "\xEF\xBB\xBFLM=2\n1.5 -2\n3e2 0.25\nIMAGE=C:\\fish\\b 1.jpg\nID=A\n",
      "LM=2\n1.5 -2\n300 0.25\nID=A\nIMAGE=b.jpg\nCOMMENT=x=1\nVARIABLES=Area=25.750\n",
  };
  for (const std::string& text : texts) {
    const LandmarkFile file = read("pair.tps", text);
    ASSERT_EQ(file.shapes.size(), 1U) << text;
    EXPECT_EQ(file.shapes.front().points, kPair) << text;
    EXPECT_EQ(file.shapes.front().name, "A") << text;
    EXPECT_THAT(file.warnings, IsEmpty()) << text;
    EXPECT_EQ(file.format, "tps");
  }
}

TEST_F(TpsFile, NamesShapesByIdThenImageThenFile) {
  const LandmarkFile file = read(
      "set.tps", "LM=1\n1 2\nIMAGE=C:\\fish\\b 1.jpg\nID=\nLM3=1\n1 2 3\nID=third one\nLM=1\n5 6\nLM=0\nID=none\n");
  ASSERT_EQ(file.shapes.size(), 4U);
  EXPECT_EQ(file.shapes[0].name, "b 1");
  EXPECT_EQ(file.shapes[1].name, "third one");
  EXPECT_EQ(file.shapes[1].points, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(file.shapes[2].name, "set#3");
  EXPECT_EQ(file.shapes[2].source, "set.tps#3");
  EXPECT_EQ(file.shapes[3].count(), 0);
  EXPECT_EQ(read_one("alone.tps", "LM=1\n5 6\n").name, "alone");
}

TEST_F(TpsFile, WarnsOncePerFileOfWhatIsNotUsed) {
  const std::string curves = "CURVES=2\nPOINTS=1\n7 8\nPOINTS=2\n1 1\n2 2\nOUTLINES=1\nPOINTS=1\n0 0\n";
  const LandmarkFile file =
      read("set.tps", "LM=1\n1 2\n" + curves + "SCALE=0.5\nLM=1\n3 4\nSCALE=0.5\nLM=1\n5 6\n" + curves);
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[0].points, Eigen::Vector2d(1, 2));
  EXPECT_THAT(
      file.warnings,
      ElementsAre("set.tps: SCALE (2 of 3 shapes) is kept and not applied: coordinates are in pixels; `applies_scale` "
                  "multiplies them by it",
                  "set.tps: 4 curves and 2 outlines (8 points) are kept and not used as landmarks; `curve_points = N` "
                  "takes N points of each"));
}

TEST_F(TpsFile, RefusesTruncatedShapes) {
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2\nID=A\nLM=3\n1 2\n3 4\nID=B\n"),
            "t.tps:4: shape 2 says 'LM=3' but has 2 lines of coordinates before line 7 is 'ID=B'");
  EXPECT_EQ(read_error("t.tps", "LM=3\n1 2\n"),
            "t.tps:1: shape 1 says 'LM=3' but has 1 line of coordinates before the file ends");
  EXPECT_EQ(read_error("t.tps", "LM=10000000000\n1 2\n"),
            "t.tps:1: shape 1 says 'LM=10000000000' but has 1 line of coordinates before the file ends");
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2\nCURVES=1\nPOINTS=2\n1 2\nID=A\n"),
            "t.tps:4: shape 1 says 'POINTS=2' but has 1 line of coordinates before line 6 is 'ID=A'");
}

TEST_F(TpsFile, RefusesLinesThatDoNotFit) {
  EXPECT_EQ(
      read_error("t.tps", "LM=1\n1 2\n3 4\nID=A\n"),
      "t.tps:3: '3 4' after the 1 landmark that shape 1 announces; a keyword such as ID= or LM= is expected here");
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2 3\n"),
            "t.tps:2: landmark 1 of shape 1 has 3 columns ('1 2 3'); LM= takes 2");
  EXPECT_EQ(read_error("t.tps", "LM3=1\n1 2\n"), "t.tps:2: landmark 1 of shape 1 has 2 columns ('1 2'); LM3= takes 3");
  EXPECT_EQ(read_error("t.tps", "LM=two\n"), "t.tps:1: 'LM=two' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "LM=-1\n"), "t.tps:1: 'LM=-1' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "LM=99999999999999999999999\n"),
            "t.tps:1: 'LM=99999999999999999999999' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "ID=A\nLM=1\n1 2\n"), "t.tps:1: 'ID=A' is before the first LM= or LM3=");
  EXPECT_EQ(read_error("t.tps", "LM 1\n1 2\n"), "t.tps:1: 'LM 1'; a tps file begins with LM= or LM3=");
}

TEST_F(TpsFile, RefusesWhatIsNoFiniteNumber) {
  EXPECT_EQ(read_error("t.tps", "LM=2\n1 2\n3 four\n"),
            "t.tps:3: landmark 2 of shape 1: y is 'four'; a number is needed");
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2\nLM=1\ninf 2\n"),
            "t.tps:4: landmark 1 of shape 2: x is 'inf'; a coordinate must be finite");
}

TEST_F(TpsFile, TakesMarksOfMissingCoordinates) {
  for (const std::string mark : {"NA", "NaN", "nan", "-nan", "?"})
    EXPECT_TRUE(have_same_bits(read_one("t.tps", "LM=3\n1 2\n" + mark + " 4\n-1 -1\n").points,
                               points_2d({1, 2, kNone, 4, -1, -1})))
        << mark;
}

}  // namespace
}  // namespace pulson::formats
