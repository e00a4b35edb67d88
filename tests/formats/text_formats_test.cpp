// Formats of one shape with a point per line: iBUG, elastix, transformix, IDAV.

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

using IbugFile = ReadingFiles;
using ElastixFile = ReadingFiles;
using TransformixFile = ReadingFiles;
using IdavFile = ReadingFiles;
using TextWriter = ReadingFiles;

// ---- iBUG

TEST_F(IbugFile, TakesEveryWayToWriteTheSamePair) {
  for (const std::string text : {
           "version: 1\nn_points: 2\n{\n1.5 -2\n300 0.25\n}\n",
           "version: 1.0\r\nn_points:  2\r\n{\r\n1.5 -2\r\n300 .25\r\n}",
           "VERSION: 1\nN_Points : 2\n\n{\n 1.5\t-2 \n\n3e2 0.25\n}\n\n",
           "\xEF\xBB\xBFn_points: 2\n{\n1.5 -2\n300 0.25\n}\n",
       }) {
    const LandmarkFile file = read("face.pts", text);
    EXPECT_EQ(file.format, "ibug") << text;
    ASSERT_EQ(file.shapes.size(), 1U);
    EXPECT_EQ(file.shapes.front().points, kPair) << text;
    EXPECT_EQ(file.shapes.front().name, "face");
    EXPECT_THAT(file.warnings, IsEmpty());
  }
  EXPECT_EQ(read_one("face.pts", "version: 1\nn_points: 1\n{\n1 2 3\n}\n").points, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(have_same_bits(read_one("face.pts", "n_points: 2\n{\n1 2\nnan nan\n}\n").points,
                             points_2d({1, 2, kNone, kNone})));
}

TEST_F(IbugFile, RefusesWhatDoesNotFit) {
  const auto error_of_text = [](const std::string& text) { return read_error("f.pts", text); };
  EXPECT_EQ(error_of_text("version: 2\nn_points: 1\n{\n1 2\n}\n"), "f.pts:1: version '2' of the format; 1 is read");
  EXPECT_EQ(error_of_text("version: 1\nn_points: x\n{\n1 2\n}\n"),
            "f.pts:2: 'x' where the number of points, a whole number from 1, is expected");
  EXPECT_EQ(error_of_text("version: 1\nn_points: 4000000000\n{\n1 2\n}\n"),
            "f.pts:5: landmark 2 has 1 coordinate; 2 are expected");
  EXPECT_EQ(error_of_text("version: 1\nn_points: 4000000000\n{\n1 2\n"),
            "f.pts:4: the file ends where landmark 2 of 4000000000 is expected");
  EXPECT_EQ(error_of_text("n_points: 1\n1 2\n}\n"), "f.pts:2: '1 2' where '{' is expected");
  EXPECT_EQ(error_of_text("n_points: 1\n{\n1 2\n3 4\n}\n"), "f.pts:4: '3 4' where '}' is expected");
  EXPECT_EQ(error_of_text("n_points: 1\n{\n1 2\n"), "f.pts:3: the file ends where '}' is expected");
  EXPECT_EQ(error_of_text("n_points: 1\n{\n1 2\n}\n1 2\n"), "f.pts:5: '1 2' after the 1 point announced");
  EXPECT_EQ(error_of_text("n_points: 1\n{\n1 2 3 4\n}\n"), "f.pts:3: '1 2 3 4' has 4 columns; 2 or 3 are expected");
  EXPECT_EQ(error_of_text("n_points: 1\n{\n1 a\n}\n"), "f.pts:3: landmark 1: y is 'a'; a number is needed");
}

// ---- elastix

TEST_F(ElastixFile, TakesPointsAndIndices) {
  for (const std::string text : {"point\n2\n1.5 -2\n300 0.25\n", "POINT\r\n2\r\n\r\n1.5\t-2\r\n3e2 .25"}) {
    const LandmarkFile file = read("in.txt", text);
    EXPECT_EQ(file.format, "elastix");
    EXPECT_EQ(file.shapes.front().points, kPair);
    EXPECT_THAT(file.warnings, IsEmpty());
  }
  const LandmarkFile indices = read("in.pts", "index\n1\n1 2 3\n");
  EXPECT_EQ(indices.shapes.front().points, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(indices.warnings,
              ElementsAre("in.pts: the points are indices of voxels, not positions; they are not converted"));
}

TEST_F(ElastixFile, RefusesOtherCounts) {
  EXPECT_EQ(read_error("in.txt", "point\n3\n1 2\n3 4\n"), "in.txt:4: the file ends where landmark 3 of 3 is expected");
  EXPECT_EQ(read_error("in.txt", "point\n1\n1 2\n3 4\n"), "in.txt:4: '3 4' after the 1 point announced");
  EXPECT_EQ(read_error("in.txt", "point\n4000000000\n1 2\n"),
            "in.txt:3: the file ends where landmark 2 of 4000000000 is expected");
  EXPECT_EQ(read_error("in.txt", "point\n0\n"),
            "in.txt:2: '0' where the number of points, a whole number from 1, is expected");
  EXPECT_EQ(read_error("in.txt", "point\n2\n1 2\n1 2 3\n"), "in.txt:4: landmark 2 has 3 coordinates; 2 are expected");
}

// ---- transformix

constexpr const char* kMoved =
    "Point\t0\t; InputIndex = [ 6335 7530 ]\t; InputPoint = [ 6335.5 7530.000000 ]\t; OutputIndexFixed = [ 6270 7520 "
    "]\t; OutputPoint = [ 6270.019712 7520.199309 ]\t; Deformation = [ -64.980286 -9.800692 ]\n"
    "Point\t1\t; InputIndex = [ 1 2 ]\t; InputPoint = [ 1 -2 ]\t; OutputIndexFixed = [ 3 4 ]\t; OutputPoint = [ 3.5 "
    "4.25 ]\t; Deformation = [ 2.5 6.25 ]\n";

TEST_F(TransformixFile, HoldsPointsBeforeAndAfter) {
  const LandmarkFile file = read("outputpoints.txt", kMoved);
  EXPECT_EQ(file.format, "transformix");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "input");
  EXPECT_EQ(file.shapes[0].points, points_2d({6335.5, 7530, 1, -2}));
  EXPECT_EQ(read_landmarks("outputpoints.txt#id=output").points, points_2d({6270.019712, 7520.199309, 3.5, 4.25}));
}

TEST_F(TransformixFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error("o.txt", "Point 0 ; OutputPoint = [ 1 2 ]\n"),
            "o.txt:1: no InputPoint = [ .. ] in 'Point 0 ; OutputPoint = [ 1 2 ]'");
  EXPECT_EQ(read_error("o.txt", "Point 0 ; InputPoint = 1 2 ; OutputPoint = [ 1 2 ]\n"),
            "o.txt:1: InputPoint is '1 2'; numbers in brackets are expected");
  EXPECT_EQ(read_error("o.txt", "Point 0 ; InputPoint = [ 1 ] ; OutputPoint = [ 1 2 ]\n"),
            "o.txt:1: InputPoint has 1 coordinate; 2 or 3 are expected");
  EXPECT_EQ(read_error("o.txt", std::string(kMoved) + "Point 2 ; InputPoint = [ 1 2 3 ] ; OutputPoint = [ 1 2 ]\n"),
            "o.txt:3: landmark 3 of InputPoint has 3 coordinates; 2 are expected");
}

// ---- IDAV

TEST_F(IdavFile, TakesCodesAndMissingMarks) {
  const LandmarkFile file =
      read("skull.pts", "Version 1.0\r\n3\r\nS000 1 2 3\r\nS001 9999 9999 9999\r\nC000 4 5 6\r\n");
  EXPECT_EQ(file.format, "idav");
  const Landmarks& shape = file.shapes.front();
  EXPECT_THAT(shape.labels, ElementsAre("S000", "S001", "C000"));
  EXPECT_TRUE(have_same_bits(shape.points, (Points(3, 3) << 1, kNone, 4, 2, kNone, 5, 3, kNone, 6).finished()));
  EXPECT_EQ(read_one("flat.pts", "Version 1.0\n2\nS0000  1.5 -2 \nS0001 300 0.25\n").points, kPair);
}

TEST_F(IdavFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error("s.pts", "Version 1.0\n2\nS000 1 2 3\n"),
            "s.pts:3: the file ends where landmark 2 of 2 is expected");
  EXPECT_EQ(read_error("s.pts", "Version 1.0\n1\nS000 1 2 3\nS001 1 2 3\n"),
            "s.pts:4: 'S001 1 2 3' after the 1 landmark announced");
  EXPECT_EQ(read_error("s.pts", "Version 1.0\n1\nS000 1\n"), "s.pts:3: 'S000 1' has 2 columns; 3 or 4 are expected");
  EXPECT_EQ(read_error("s.pts", "Version 1.0\n1\nS000 1 2 x\n"),
            "s.pts:3: landmark 'S000': z is 'x'; a number is needed");
}

// ---- writing

TEST_F(TextWriter, KeepsTheBits) {
  for (const int d : {2, 3})
    for (const std::string format : {"ibug", "elastix"}) {
      LandmarkFile file;
      file.shapes.emplace_back().points = hard_points(d, 500);
      EXPECT_THAT(write_landmark_file("out.pts", file, format), IsEmpty());
      const LandmarkFile back = read_landmark_file("out.pts");
      EXPECT_EQ(back.format, format);
      EXPECT_TRUE(have_same_bits(back.shapes.front().points, file.shapes.front().points)) << format << d;
    }
}

TEST_F(TextWriter, SaysWhatItCannotHold) {
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  shape.points = points_2d({1, kNone});
  shape.name = "skull";
  shape.labels = {"tip"};
  shape.scale = 2;
  file.units = "mm";
  EXPECT_THAT(write_landmark_file("out.pts", file),
              ElementsAre("out.pts: ibug cannot hold names of shapes", "out.pts: ibug cannot hold labels",
                          "out.pts: ibug cannot hold scales", "out.pts: ibug cannot hold the units 'mm'"));
  EXPECT_EQ(contents("out.pts"), "version: 1\nn_points: 1\n{\n1 nan\n}\n");
  const auto error = [&](const std::string& format) { return write_error("out.pts", file, format); };
  EXPECT_EQ(error("elastix"),
            "out.pts: elastix cannot hold missing coordinates; landmark 'tip' of the shape 'skull' misses one");
  shape.points = Points::Zero(1, 1);
  EXPECT_EQ(error("ibug"), "out.pts: ibug holds shapes in 2D or 3D; the shape 'skull' is in 1D");
  file.shapes.emplace_back();
  EXPECT_EQ(error("elastix"), "out.pts: elastix holds one shape; there are 2");
  EXPECT_THAT(error("idav"), HasSubstr("'idav' is not a landmark format that can be written"));
}

TEST_F(TextWriter, LeavesUnknownFilesToTheError) {
  for (const std::string name : {"notes.pts", "notes.txt"})
    EXPECT_THAT(read_error(name, "Landmark 1 is the tip\n"),
                HasSubstr(name + " is not in any of the landmark formats"));
}

}  // namespace
}  // namespace pulson::formats
