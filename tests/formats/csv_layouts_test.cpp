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

class ReadingLayouts : public ReadingTexts {
 protected:
  static std::string read_error(const std::string& text, const std::string& name = "t.csv") {
    return ReadingFiles::read_error(name, text);
  }

  static void expect_two_pairs(const std::string& text) {
    const LandmarkFile file = read(text);
    ASSERT_EQ(file.shapes.size(), 2U) << text;
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4})) << text;
    EXPECT_EQ(file.shapes[1].points, points_2d({5, 6, 7, 8.5})) << text;
    EXPECT_EQ(file.shapes[0].name, "A") << text;
    EXPECT_EQ(file.shapes[1].name, "B") << text;
    EXPECT_THAT(file.shapes[0].labels, IsEmpty()) << text;
    EXPECT_THAT(file.warnings, IsEmpty()) << text;
    EXPECT_EQ(file.format, "csv") << text;
  }
};

using CoordinateRows = ReadingLayouts;
using ShapeRows = ReadingLayouts;
using AxisRows = ReadingLayouts;
using NamedPoints = ReadingLayouts;
using DecimalCommas = ReadingLayouts;

// ---- a coordinate per line

TEST_F(CoordinateRows, AreReadInAnyOrderAndSpelling) {
  expect_two_pairs(
      "pos;shape;value;landmark\npos1;A;1;1\npos2;A;2;1\npos1;A;3;2\npos2;A;4;2\n"
      "pos1;B;5;1\npos2;B;6;1\npos1;B;7;2\npos2;B;8.5;2\n");
  expect_two_pairs(
      "specimen,landmark,axis,value\r\nA,1,y,2\r\nB,1,y,6\r\nA,2,x,3\r\nB,2,x,7\r\nA,2,y,4\r\nB,2,y,8.5\r\n"
      "A,1,x,1\r\nB,1,x,5\r\n");
  expect_two_pairs(
      "\xEF\xBB\xBFValue\tDim\tid\tspecimen_id\n1\t1\t1\tA\n2\t2\t1\tA\n3\t1\t2\tA\n4\t2\t2\tA\n"
      "5\t1\t1\tB\n6\t2\t1\tB\n7\t1\t2\tB\n8.5\t2\t2\tB\n");
}

TEST_F(CoordinateRows, MayHaveOneOrThreeAxesGroupsAndNames) {
  EXPECT_EQ(read("coordinate,landmark,value\nX,1,0.5\nX,2,1\n").shapes.front().points,
            (Points(1, 2) << 0.5, 1).finished());
  const LandmarkFile file = read("group,label,axis,value,by\na,tip,3,7,me\na,tip,2,NA,me\na,tip,1,5,me\n");
  EXPECT_TRUE(have_same_bits(file.shapes.front().points, Eigen::Vector3d(5, kNone, 7)));
  EXPECT_THAT(file.shapes.front().labels, ElementsAre("tip"));
  EXPECT_THAT(file.shapes.front().groups, ElementsAre("a"));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: columns that are not used: 'by'"));
}

TEST_F(CoordinateRows, AreRefusedWhereCoordinatesRepeatOrLack) {
  EXPECT_EQ(read_error("axis,landmark,value\nx,1,1\ny,1,2\nx,1,3\n"),
            "t.csv:4: x of landmark '1' is already on line 2");
  EXPECT_EQ(read_error("axis,shape,landmark,value\nx,A,1,1\ny,A,1,2\ny,A,2,2\n"),
            "t.csv:4: landmark '2' of specimen 'A' has no line with its x; where that is missing, write NA");
  EXPECT_EQ(read_error("axis,landmark,value\nw,1,1\n"),
            "t.csv:2: the axis is 'w'; valid: x, y, z or 1, 2, 3 or pos1, pos2, pos3");
  EXPECT_EQ(read_error("axis,landmark,value\nx,1,far\n"), "t.csv:2: landmark '1': x is 'far'; a number is needed");
  EXPECT_EQ(read_error("axis,value\nx,1\n"),
            "t.csv:1: a table with a coordinate per line needs a column landmark beside the axis and the value");
  EXPECT_EQ(read_error("axis,landmark,value\nx,,1\n"), "t.csv:2: the landmark has no name; each line needs one");
  EXPECT_EQ(read_error("axis,landmark,shape,value\nx,1,,1\n"), "t.csv:2: the specimen is empty; each line needs one");
  EXPECT_EQ(read_error("axis,landmark,value\n"), "t.csv holds a header and no landmarks");
  EXPECT_EQ(read_error("axis,landmark,value\nx,1\n"),
            "t.csv:2: 2 columns, but line 1 has 3; all lines must have the same number");
}

// ---- a shape per line

TEST_F(ShapeRows, AreReadByTheNamesOfTheirColumns) {
  expect_two_pairs("id,X1,Y1,X2,Y2\nA,1,2,3,4\nB,5,6,7,8.5\n");
  expect_two_pairs("id,x1,x2,y1,y2\nA,1,3,2,4\nB,5,7,6,8.5\n");
  expect_two_pairs("y_2;x_2;y_1;x_1;Specimen\n4;3;2;1;A\n8,5;7;6;5;B\n");
  expect_two_pairs("\"\",\"1.X\",\"1.Y\",\"2.X\",\"2.Y\"\n\"A\",1,2,3,4\n\"B\",5,6,7,8.5\n");
  expect_two_pairs("name\tX1.X\tX1.Y\tX2.X\tX2.Y\nA\t1\t2\t3\t4\nB\t5\t6\t7\t8.5\n");
  expect_two_pairs("id,1_X,1_Y,2_X,2_Y\nA,1,2,3,4\nB,5,6,7,8.5\n");
  expect_two_pairs("id,LM 1_X,LM 1_Y,LM 2_X,LM 2_Y\nA,1,2,3,4\nB,5,6,7,8.5\n");
}

TEST_F(ShapeRows, KeepNumbersThatDoNotCountFromOne) {
  const Landmarks zero = read("X0,Y0,X1,Y1\n1,2,3,NA\n").shapes.front();
  EXPECT_TRUE(have_same_bits(zero.points, points_2d({1, 2, 3, kNone})));
  EXPECT_THAT(zero.labels, ElementsAre("0", "1"));
  EXPECT_EQ(zero.name, "t");
  const LandmarkFile far = read("x1,y1,z1,sex,x99999999999,y99999999999,z99999999999\n1,2,3,f,4,5,6\n");
  EXPECT_EQ(far.shapes.front().points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_THAT(far.shapes.front().labels, ElementsAre("1", "99999999999"));
  EXPECT_THAT(far.warnings, ElementsAre("t.txt: columns that are not used: 'sex'"));
}

TEST_F(ShapeRows, TakeTheColumnOfSpecimensForTheirNames) {
  const LandmarkFile file = read(",id,specimen,x1,y1\n1,7,S7,0,1\n2,8,S7,2,3\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[1].name, "S7");
  EXPECT_EQ(file.shapes[1].source, "t.txt#2");
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: columns that are not used: 'id'"));
}

TEST_F(ShapeRows, MayNameTheirLandmarks) {
  for (const std::string header :
       {"nose_x,nose_y,tail_x,tail_y", "nose.x,nose.y,tail.x,tail.y", "nose-X,nose-Y,tail-X,tail-Y",
        "nose x,nose y,tail x,tail y", "noseX,noseY,tailX,tailY", "x_nose,y_nose,x_tail,y_tail",
        "X.nose,Y.nose,X.tail,Y.tail", "nose(x),nose(y),tail(x),tail(y)"}) {
    const LandmarkFile file = read("id," + header + "\nA,1,2,3,4\nB,5,6,7,NA\n");
    ASSERT_EQ(file.shapes.size(), 2U) << header;
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4})) << header;
    EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({5, 6, 7, kNone}))) << header;
    EXPECT_EQ(file.shapes[1].name, "B");
    EXPECT_THAT(file.shapes[1].labels, ElementsAre("nose", "tail")) << header;
    EXPECT_THAT(file.warnings, IsEmpty()) << header;
  }
  EXPECT_THAT(read("L1x,L1y,L2x,L2y\n1,2,3,4\n").shapes.front().labels, ElementsAre("L1", "L2"));
  expect_two_pairs("id,x[1],y[1],x[2],y[2]\nA,1,2,3,4\nB,5,6,7,8.5\n");
  expect_two_pairs("id,x(1),y(1),x(2),y(2)\nA,1,2,3,4\nB,5,6,7,8.5\n");
  expect_two_pairs("id,X.LM1,Y.LM1,X.LM2,Y.LM2\nA,1,2,3,4\nB,5,6,7,8.5\n");
}

TEST_F(ShapeRows, MayNameLandmarksInSpace) {
  const LandmarkFile file = read("tip_z,tip_x,tip_score,tip_y\n3,1,0.5,2\n");
  EXPECT_EQ(file.shapes.front().points, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: columns that are not used: 'tip_score'"));
}

TEST_F(ShapeRows, TakeNamesFromOtherColumns) {
  for (const std::string header : {"Specimen ID", "filename", "frame", "image_id", "individual", "sample"}) {
    const LandmarkFile file = read(header + ",x1,y1,x2,y2\nA,1,2,3,4\nB,5,6,7,8\n");
    EXPECT_EQ(file.shapes[1].name, "B") << header;
    EXPECT_THAT(file.warnings, IsEmpty()) << header;
  }
  const LandmarkFile file = read("id,file,x1,y1\n7,a.JPG,1,2\n");
  EXPECT_EQ(file.shapes.front().name, "7");
  EXPECT_EQ(file.shapes.front().image, "a.JPG");
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(ShapeRows, OfSleapAreNamedByTrackAndFrame) {
  const LandmarkFile file = read(
      "track,frame_idx,instance.score,nose.x,nose.y,nose.score,tail.x,tail.y,tail.score\n"
      "m1,0,0.9,1,2,0.9,3,4,0.8\nm1,1,0.9,5,6,0.9,,,\n,1,0.9,7,8,0.9,9,10,0.1\n");
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[0].name, "m1/0");
  EXPECT_EQ(file.shapes[2].name, "1");
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({5, 6, kNone, kNone})));
  EXPECT_THAT(file.warnings,
              ElementsAre("t.txt: columns that are not used: 'instance.score', 'nose.score', 'tail.score'"));
}

TEST_F(ShapeRows, AreRefusedWhereLinesHoldALandmarkOfTwoShapes) {
  for (const std::string header :
       {"source_x,source_y,target_x,target_y", "step,landmark,q_x,q_y", "x_min,y_min,x_max,y_max"})
    EXPECT_THAT(read_error(header + "\n1,2,3,4\n"), HasSubstr("t.csv:1: no coordinates in the columns ")) << header;
  EXPECT_EQ(read_error("id,nose_x,nose_y,tail_x\nA,1,2,3\n"), "t.csv:1: no column holds y of landmark 'tail'");
  const std::string name(201, 'a');
  EXPECT_EQ(read_error(name + "_x," + name + "_y\n1,2\n"),
            "t.csv:1: the name '" + std::string(60, 'a') + "...' is longer than 200 bytes");
  EXPECT_THAT(read("nose_x,nose_y\n1,2\n3,4\n").warnings,
              ElementsAre("t.txt: each line is read as a shape of one landmark"));
}

TEST_F(ShapeRows, NeedNoHeaderWhereTheirNumbersAreOfOneDimension) {
  const LandmarkFile file = read("a 1\t1\t2\t3\t4\t5\t6\t7\t8\na 2\t1\t2\t3\t4\t5\t6\t7\tNA\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(file.shapes[1].name, "a 2");
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: a name and 8 numbers per line without a header, read as shapes of 4 "
                                         "landmarks in 2D"));
  EXPECT_EQ(read("a 1 2 3 4 5 6 7 8 9\n").shapes.front().points.col(2), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(read_error("a 1 2 3 4 5 6\n"),
            "t.csv:1: a name and 6 numbers may be 3 landmarks in 2D or 2 in 3D; a header id,x1,y1,... or "
            "id,x1,y1,z1,... says which");
  EXPECT_EQ(read_error("a 1 2 3 4 5\n"), "t.csv:1: a name and 5 numbers, which landmarks in 2D or 3D cannot have");
  EXPECT_EQ(read_error("a 1 2 3 4\nb 1 2\n"),
            "t.csv:1: 'a' is not a number; a table with more than coordinates needs a "
            "header such as label,x,y");
}

TEST_F(ShapeRows, AreRefusedWhereColumnsDoNotFit) {
  EXPECT_EQ(read_error("id,X1,Y1,X2\nA,1,2,3\n"), "t.csv:1: no column holds y of landmark 2");
  EXPECT_EQ(read_error("id,X1,Y1,1.X\nA,1,2,3\n"), "t.csv:1: the columns 'X1' and '1.X' mean the same; give only one");
  EXPECT_EQ(read_error("id,X1,Y1\nA,1,2\nB,1,?!\n"), "t.csv:3: landmark 1 of shape 2: y is '?!'; a number is needed");
  EXPECT_EQ(read_error("id,X1,Y1\nA,1\n"), "t.csv:2: 2 columns, but line 1 has 3; all lines must have the same number");
  EXPECT_EQ(read_error("id,X1,Y1\n"), "t.csv holds a header and no landmarks");
  EXPECT_THAT(read_error("id,x1,x2,x3\nA,1,2,3\n"), HasSubstr("t.csv:1: no coordinates in the columns 'id', 'x1',"));
}

// ---- an axis per line

TEST_F(AxisRows, AreReadByTheirNames) {
  expect_two_pairs(
      "\"A\"\t\"x-coordinates\"\t1\t3\n\"A\"\t\"y-coordinates\"\t2\t4\n\"B\"\t\"x-coordinates\"\t5\t7\n"
      "\"B\"\t\"y-coordinates\"\t6\t8.5\n");
  expect_two_pairs("A,x,1,3\nA,y,2,4\nB,x,5,7\nB,y,6,8.5\n");
  const LandmarkFile file = read("X 1 2\nY 3 4\nZ 5 NA\nX 1 2\nY 3 4\nZ 5 6\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_TRUE(have_same_bits(file.shapes[0].points, (Points(3, 2) << 1, 2, 3, 4, 5, kNone).finished()));
  EXPECT_EQ(file.shapes[1].name, "t#2");
  EXPECT_EQ(read("A,x,1,3\nA,y,2,4\nA,x,1\nA,y,9\n").shapes[1].points, Eigen::Vector2d(1, 9));
}

TEST_F(AxisRows, AreRefusedOutOfOrder) {
  EXPECT_EQ(read_error("A,x,1,3\nB,y,2,4\n"),
            "t.csv:2: y of 'B' does not follow x; each shape needs a line of x, one of y after it, and so on");
  EXPECT_EQ(read_error("y,1,3\nx,2,4\n"),
            "t.csv:1: y does not follow x; each shape needs a line of x, one of y after it, and so on");
  EXPECT_EQ(read_error("A,x,1,3\nA,z,2,4\n"),
            "t.csv:2: z of 'A' does not follow y; each shape needs a line of x, one of y after it, and so on");
  EXPECT_EQ(read_error("A,x,1,3\nA,y,2\n"), "t.csv:2: 1 coordinate of y of 'A', but 2 of x on line 1");
  EXPECT_EQ(read_error("A,x,1,3\nA,width,2,4\n"),
            "t.csv:2: column 2 names no axis; it needs x, y or z, as in the first line");
  EXPECT_EQ(read_error("A,x,1,3\nA,y,2,4\nB,x,1,2\n"),
            "t.csv:3: a shape of 1 axis, but the one of line 1 has 2; all shapes must have the same number");
  EXPECT_EQ(read_error("A,x,1,3\nA,y,2,far\n"), "t.csv:2: landmark 2 of shape 1: y is 'far'; a number is needed");
}

TEST_F(AxisRows, MayDoWithoutNames) {
  const LandmarkFile file = read("1 2 3 4\n5 6 7 NA\n");
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_TRUE(have_same_bits(file.shapes.front().points, points_2d({1, 5, 2, 6, 3, 7, 4, kNone})));
  EXPECT_THAT(file.warnings,
              ElementsAre("t.txt: 2 lines of 4 numbers without a header, read as the axes x, y of one shape"));
  EXPECT_EQ(read_error("1 10 20 30\n2 11 21 31\n3 12 22 33\n"),
            "t.csv:1: the first column counts the lines; the table needs a header such as id,x,y,z");
  EXPECT_EQ(read("1,2,3,4\n5,6,7,8\n9,10,11,12\n").shapes.front().points.col(3), Eigen::Vector3d(4, 8, 12));
  EXPECT_EQ(read("1,2,3\n4,5,6\n").shapes.front().points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_EQ(read_error("1,2,3,4\n5,6,7\n"),
            "t.csv:2: 3 columns, but line 1 has 4; all lines must have the same number");
  EXPECT_THAT(read_error("1,2,3,4\n5,6,7,8\n1,2,3,4\n5,6,7,8\n"), HasSubstr("t.csv:1: 4 columns without a header;"));
}

// ---- a name and coordinates per line, without header

TEST_F(NamedPoints, NeedNoHeader) {
  const Landmarks shape = read("left eye\t1\t2\nnose\tNA\tNA\n").shapes.front();
  EXPECT_TRUE(have_same_bits(shape.points, points_2d({1, 2, kNone, kNone})));
  EXPECT_THAT(shape.labels, ElementsAre("left eye", "nose"));
  EXPECT_EQ(read("tip 1 2 3\n").shapes.front().points, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(read("tip NA NA\nbase 1 2\n").shapes.front().labels, ElementsAre("tip", "base"));
}

TEST_F(NamedPoints, AreRefusedWhereTheyAreSomethingElse) {
  EXPECT_THAT(read_error("tip,1,2\ntip,3,4\n"), HasSubstr("t.csv:2: landmark 'tip' is already on line 1;"));
  EXPECT_THAT(read_error("depth,1\nage,2\n"), HasSubstr("t.csv:1: 'depth' is not a number;"));
  EXPECT_THAT(read_error("tip 1 2\nthe end\n", "t.txt"), HasSubstr("is not in any of the landmark formats"));
}

// ---- decimal commas

TEST_F(DecimalCommas, AreReadBetweenSemicolonsAndTabs) {
  for (const std::string text : {"1,5;2\n-3,25;+4e1\n", "1,5\t2,0\n-3,25\t40\n", "x\ty\n1,5\t2\n-3,25\t0,4e2\n",
                                 "\"1,5\";\"2\"\r\n\"-3,25\";\"40\"\r\n"})
    EXPECT_EQ(read(text).shapes.front().points, points_2d({1.5, 2, -3.25, 40})) << text;
  EXPECT_EQ(read("x,y\n\"1,5\",\"2\"\n\"-3,25\",40\n").shapes.front().points, points_2d({1.5, 2, -3.25, 40}));
  EXPECT_THAT(read("label,x,y\n\"1,5\",\"1,5\",2\n").shapes.front().labels, ElementsAre("1,5"));
  EXPECT_EQ(read("1,5\n2,5\n").shapes.front().points, points_2d({1, 5, 2, 5}));
}

TEST_F(DecimalCommas, AreRefusedWhereTheyMayBeOthers) {
  EXPECT_EQ(read_error("x;y\n1,234,567;2\n"), "t.csv:2: landmark 1: x is '1,234,567'; a number is needed");
  EXPECT_EQ(read_error("x;y\n1,5;2.5\n"), "t.csv:2: landmark 1: x is '1,5'; a number is needed");
  EXPECT_EQ(read_error("x,y\n\"1,234\",\"2,345\"\n"), "t.csv:2: landmark 1: x is '1,234'; a number is needed");
  EXPECT_EQ(read_error("x,y\n\"1,5\",2.5\n"), "t.csv:2: landmark 1: x is '1,5'; a number is needed");
  EXPECT_EQ(read_error("x;y\n,5;2\n"), "t.csv:2: landmark 1: x is ',5'; a number is needed");
  EXPECT_THAT(read("label;x;y\na, b;1;2\n").shapes.front().labels, ElementsAre("a, b"));
}

}  // namespace
}  // namespace pulson::formats
