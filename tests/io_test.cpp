#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/io/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class ReadingFiles : public InTemporaryFolder {
 protected:
  static LandmarkFile read(const std::string& name, const std::string& text) {
    write(name, text);
    return read_landmark_file(name);
  }

  static Landmarks read_one(const std::string& name, const std::string& text) {
    write(name, text);
    return read_landmarks(name);
  }

  static std::string read_error(const std::string& name, const std::string& text) {
    return error_of([&] { read(name, text); });
  }

  static std::string address_error(const std::string& address) {
    return error_of([&] { read_landmarks(address); });
  }
};

const Points kPair = points_2d({1.5, -2, 3e2, 0.25});

using CsvFile = ReadingFiles;
using TpsFile = ReadingFiles;
using Address = ReadingFiles;
using Unreadable = ReadingFiles;

// ---- csv: what is read

TEST_F(CsvFile, TakesEveryWayToWriteTheSamePair) {
  const std::vector<std::string> texts = {
      "1.5,-2\n300,0.25\n",
      "1.5;-2\n3e2;.25",
      "1.5\t-2\n300\t0.25\n",
      "1.5   -2\n  +300 0.25  \n",
      "1.5 \t -2\n300\t0.25\n",
      "x,y\n1.5,-2\n300,0.25\n",
      "X;Y\n1.5;-2\n300;0.25\n",
      "x y\n1.5 -2\n300 0.25\n",
      "pos1\tpos2\n1.5\t-2\n300\t0.25\n",
      "\"x\",\"y\"\n\"1.5\" , \"-2\"\n\"300\",0.25\n",
      "\"x\" \"y\"\n\"1.5\" -2\n300 \"0.25\"\n",
      "x,y\r\n1.5,-2\r\n300,0.25\r\n",
      "x,y\r1.5,-2\r300,0.25",
      "# made by hand\n\n  # x, y\n\n1.5,-2\n\n   \n300,0.25\n\n",
      "\xEF\xBB\xBFx,y\n1.5,-2\n300,0.25\n",
      "\xEF\xBB\xBF\061.5,-2\n300,0.25\n",
      "y,x\n-2,1.5\n0.25,300\n",
      " ,X,Y\n1,1.5,-2\n2,300,0.25\n",
      "landmark,x,y\n1,1.5,-2\n2,300,0.25\n",
  };
  for (const std::string& text : texts) {
    const LandmarkFile file = read("pair.csv", text);
    ASSERT_EQ(file.shapes.size(), 1U) << text;
    const Landmarks& shape = file.shapes.front();
    EXPECT_EQ(shape.points, kPair) << text;
    EXPECT_THAT(shape.labels, IsEmpty()) << text;
    EXPECT_THAT(shape.groups, IsEmpty()) << text;
    EXPECT_THAT(file.warnings, IsEmpty()) << text;
    EXPECT_EQ(shape.name, "pair");
    EXPECT_EQ(shape.source, "pair.csv");
    EXPECT_EQ(file.format, "csv");
  }
}

TEST_F(CsvFile, TakesOneAndThreeDimensions) {
  EXPECT_EQ(read_one("a.csv", "x\n1\n2\n").points, (Points(1, 2) << 1, 2).finished());
  EXPECT_EQ(read_one("b.csv", "pos1;landmark\n0.5;1\n1.0;2\n").points, (Points(1, 2) << 0.5, 1).finished());
  EXPECT_EQ(read_one("c.csv", "1,2,3\n4,5,6\n").points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_EQ(read_one("d.csv", "z,x,y\n3,1,2\n").points, (Points(3, 1) << 1, 2, 3).finished());
}

TEST_F(CsvFile, IsRecognisedByContent) {
  EXPECT_EQ(read("points.txt", "1 2\n3 4\n").format, "csv");
  EXPECT_EQ(read("points.tps", "x,y\n3,4\n").format, "csv");
  EXPECT_EQ(read("points.csv", "LM=1\n3 4\n").format, "tps");
}

TEST_F(CsvFile, TakesLabelsAndGroups) {
  for (const std::string column : {"label", "Landmark", "name", "ID", "coord_id", ""}) {
    const Landmarks shape = read_one("named.csv", column + ",x,y\nnose,1,2\n\"left, eye\",3,4\n");
    EXPECT_THAT(shape.labels, ElementsAre("nose", "left, eye")) << column;
  }
  for (const std::string column : {"group", "outline"}) {
    const Landmarks shape = read_one("rings.csv", "x,y," + column + "\n1,2,a\n3,4,b\n5,6,a\n");
    EXPECT_THAT(shape.groups, ElementsAre("a", "b", "a"));
  }
  EXPECT_THAT(read_one("zero.csv", "coord_id,x,y\n0,1,2\n1,3,4\n").labels, ElementsAre("0", "1"));
  EXPECT_THAT(read_one("indexed.csv", ",name,x,y\n0,tip,1,2\n1,base,3,4\n").labels, ElementsAre("tip", "base"));
  EXPECT_THAT(read_one("quote.csv", "name,x\n\"the \"\"tip\"\"\",1\n").labels, ElementsAre("the \"tip\""));
  EXPECT_EQ(read_one("twice.csv", "group,id,x,y\na,1,0,0\na,2,1,0\nb,1,5,5\nb,2,6,5\n").count(), 4);
}

TEST_F(CsvFile, SplitsLongTablesBySpecimen) {
  for (const std::string header : {"specimen,landmark", "specimen_id,coord_id", "Shape,id"}) {
    const LandmarkFile file = read("wings.csv", header + ",x,y\nB,1,0,1\nB,2,2,3\nA 2,1,4,5\nA 2,2,6,7\nB,3,8,9\n");
    ASSERT_EQ(file.shapes.size(), 2U);
    EXPECT_EQ(file.shapes[0].name, "B");
    EXPECT_EQ(file.shapes[0].points, points_2d({0, 1, 2, 3, 8, 9}));
    EXPECT_EQ(file.shapes[0].source, "wings.csv#1");
    EXPECT_EQ(file.shapes[1].name, "A 2");
    EXPECT_EQ(file.shapes[1].points, points_2d({4, 5, 6, 7}));
    EXPECT_EQ(file.shapes[1].source, "wings.csv#2");
  }
  EXPECT_EQ(read_one("one.csv", "specimen,landmark,x,y,z\nS7,1,0,1,2\n").name, "S7");
}

TEST_F(CsvFile, WarnsWhereItHadToChoose) {
  EXPECT_THAT(read("w.csv", "x,y,weight,\n1,2,3,\n").warnings,
              ElementsAre("w.csv: columns that are not used: 'weight' ''"));
  EXPECT_THAT(read("w.csv", "5\n7\n6\n").warnings,
              ElementsAre("w.csv: one column without a header, read as 3 landmarks on a line (1D)"));
  EXPECT_THAT(
      read("w.csv", "1,5\n2,7\n3,9\n").warnings,
      ElementsAre("w.csv: the first column counts the lines and is read as the coordinate x; if it is an index, "
                  "give the table a header such as id,x,y"));
}

// ---- csv: what is refused

TEST_F(CsvFile, RefusesTablesWithoutCoordinates) {
  EXPECT_EQ(read_error("mice_groups.csv", "specimen,group\n1,c\n2,c\n"),
            "mice_groups.csv:1: no coordinates in the columns 'specimen', 'group'; a landmark table has columns "
            "x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds several shapes");
  EXPECT_THAT(read_error("wide.csv", "id,X1,Y1,X2,Y2,X3,Y3\na,1,2,3,4,5,6\n"),
              StartsWith("wide.csv:1: no coordinates in the columns 'id', 'X1', 'Y1', 'X2', 'Y2', 'X3', ...;"));
  EXPECT_THAT(read_error("t.csv", "x,z\n1,2\n"), StartsWith("t.csv:1: there is a column 'z' but none for y;"));
  EXPECT_THAT(read_error("t.csv", "name,Y\na,2\n"), StartsWith("t.csv:1: there is a column 'Y' but none for x;"));
}

TEST_F(CsvFile, RefusesAmbiguousColumns) {
  EXPECT_EQ(read_error("t.csv", "x,y,X\n1,2,3\n"),
            "t.csv:1: the columns 'x' and 'X' mean the same, one of them is needed");
  EXPECT_EQ(
      read_error("t.csv", "id,landmark,x,y\n1,2,3,4\n"),
      "t.csv:1: the columns 'id' and 'landmark' mean the same, one of them is needed; call the one that names the "
      "specimen 'specimen'");
  EXPECT_EQ(
      read_error("t.csv", "landmark,x,y\n1,2,3\n2,4,5\n1,6,7\n"),
      "t.csv:4: landmark '1' stands on line 2 already; labels must differ within a shape, a column specimen tells "
      "shapes apart and a column group outlines");
  EXPECT_THAT(read_error("t.csv", "specimen,landmark,x\nA,1,2\nA,1,3\n"),
              StartsWith("t.csv:3: landmark '1' of specimen 'A' stands on line 2 already;"));
  EXPECT_EQ(read_error("t.csv", "specimen,landmark,x,y\nA,1,2,3\n,2,4,5\n"),
            "t.csv:3: the specimen is empty; each line needs one");
}

TEST_F(CsvFile, RefusesLinesThatDoNotFit) {
  EXPECT_EQ(read_error("t.csv", "x,y\n1,2\n\n1,2,3\n"), "t.csv:4: 3 columns, but line 1 has 2; all lines need as many");
  EXPECT_EQ(read_error("t.csv", "1,2\n3\n"), "t.csv:2: 1 column, but line 1 has 2; all lines need as many");
  EXPECT_EQ(
      read_error("t.csv", "1,2,3,4\n"),
      "t.csv:1: 4 columns without a header; a table without one has the columns x[,y[,z]], one landmark per line");
  EXPECT_EQ(read_error("t.csv", "\"Pt-0\",\"true\",47.5,3\n"),
            "t.csv:1: 'Pt-0' is not a number; a table with more than coordinates needs a header such as label,x,y");
  EXPECT_EQ(read_error("t.csv", "x,y\n1,\"2\n"),
            "t.csv:2: broken quotes in '1,\"2'; a field in quotes is \"like this\"");
  EXPECT_EQ(read_error("t.csv", "x,y\n\"1\"2,3\n"),
            "t.csv:2: broken quotes in '\"1\"2,3'; a field in quotes is \"like this\"");
  EXPECT_EQ(read_error("t.csv", "x,y\n"), "t.csv holds a header and no landmarks");
  EXPECT_EQ(read_error("t.csv", "# nothing\n\n"),
            "t.csv holds only blank lines and comments; it needs lines x[,y[,z]]");
}

TEST_F(CsvFile, RefusesWhatIsNoNumber) {
  EXPECT_EQ(read_error("t.csv", "x,y\n1,2\n3,four\n"), "t.csv:3: landmark 2: y is 'four'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x;y\n1,5;2\n"), "t.csv:2: landmark 1: x is '1,5'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "label,x\ntip,1 2\n"), "t.csv:2: landmark 'tip': x is '1 2'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x\n1e999\n"), "t.csv:2: landmark 1: x is '1e999'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x\n" + std::string(100, 'a') + "\n"),
            "t.csv:2: landmark 1: x is '" + std::string(60, 'a') + "...'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x\na\x1B[31mb\n"), "t.csv:2: landmark 1: x is 'a?[31mb'; a number is needed");
}

TEST_F(CsvFile, RefusesInfiniteCoordinates) {
  for (const std::string infinite : {"inf", "-Inf", "infinity"})
    EXPECT_EQ(read_error("t.csv", "x,y\n1,2\n3," + infinite + "\n"),
              "t.csv:3: landmark 2: y is '" + infinite + "'; a coordinate must be finite");
}

// ---- csv: missing coordinates

// Whether all coordinates but those of `missing` are equal, and those are NaN.
testing::AssertionResult are_equal_but(const Points& points, const Points& expected, const std::vector<int>& missing) {
  if (incomplete_points(points) != missing) return testing::AssertionFailure() << "others are missing in\n" << points;
  const auto both_missing = points.array().isNaN() && expected.array().isNaN();
  if (points.rows() == expected.rows() && points.cols() == expected.cols() &&
      (both_missing || points.array() == expected.array()).all())
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << points << "\nis not\n" << expected;
}

const double kNone = std::numeric_limits<double>::quiet_NaN();

TEST_F(CsvFile, TakesMarksOfMissingCoordinates) {
  for (const std::string mark : {"NA", "", "NaN", "nan", "-nan", "null", "-", "?", "."})
    EXPECT_TRUE(are_equal_but(read_one("t.csv", "x,y\n1,2\n3," + mark + "\n5,6\n").points,
                              points_2d({1, 2, 3, kNone, 5, 6}), {1}))
        << mark;
  const LandmarkFile file = read("t.csv", "specimen,landmark,x,y\nA,1,2,3\nA,tip,NA,NA\nB,1,NA,7\n");
  EXPECT_TRUE(are_equal_but(file.shapes[0].points, points_2d({2, 3, kNone, kNone}), {1}));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("1", "tip"));
  EXPECT_TRUE(are_equal_but(file.shapes[1].points, points_2d({kNone, 7}), {0}));
}

TEST_F(CsvFile, IsRecognisedWithMissingCoordinates) {
  const Points expected = points_2d({kNone, kNone, 1, 2});
  for (const std::string text : {"NA,NA\n1,2\n", "NA NA\n1 2\n", "nan\tnan\n1\t2\n", "x,y\nNA,NA\n1,2\n", ",\n1,2\n"}) {
    const LandmarkFile file = read("points.txt", text);
    EXPECT_EQ(file.format, "csv") << text;
    EXPECT_TRUE(are_equal_but(file.shapes.front().points, expected, {0})) << text;
  }
  EXPECT_TRUE(are_equal_but(read_one("points.txt", "NA,5\n1,2\n").points, points_2d({kNone, 5, 1, 2}), {0}));
  EXPECT_TRUE(are_equal_but(read_one("all.csv", "NA,NA\n").points, points_2d({kNone, kNone}), {0}));
  EXPECT_THAT(read_error("notes.txt", "-\nfirst, a line of text\n"), HasSubstr("is in none of the landmark formats"));
}

// ---- tps

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
  EXPECT_THAT(file.warnings,
              ElementsAre("set.tps: SCALE is recorded (2 of 3 shapes) and not applied to the coordinates",
                          "set.tps: 4 curves and 2 outlines (8 points) are not used"));
}

TEST_F(TpsFile, WarnsOfMarksOfMissingLandmarks) {
  EXPECT_THAT(
      read("a.tps", "LM=3\n-1 -1\n4 5\n-1.0 -1.0\n").warnings,
      ElementsAre("a.tps: 2 landmarks at (-1, -1), often the mark of a missing one, read as a point like any other"));
  EXPECT_THAT(read("b.tps", "LM=3\n-1 -1\n1 -1\n0 1\n").warnings, IsEmpty());
  EXPECT_THAT(read("c.tps", "LM=3\n-1 -1\nNA 5\n0 1\n").warnings, ElementsAre(HasSubstr("1 landmark at (-1, -1)")));
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
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2\n3 4\nID=A\n"),
            "t.tps:3: '3 4' after the 1 landmark that shape 1 announces; a keyword such as ID= or LM= is right here");
  EXPECT_EQ(read_error("t.tps", "LM=1\n1 2 3\n"),
            "t.tps:2: landmark 1 of shape 1 has 3 columns ('1 2 3'); LM= takes 2");
  EXPECT_EQ(read_error("t.tps", "LM3=1\n1 2\n"), "t.tps:2: landmark 1 of shape 1 has 2 columns ('1 2'); LM3= takes 3");
  EXPECT_EQ(read_error("t.tps", "LM=two\n"), "t.tps:1: 'LM=two' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "LM=-1\n"), "t.tps:1: 'LM=-1' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "LM=99999999999999999999999\n"),
            "t.tps:1: 'LM=99999999999999999999999' needs a whole number, not negative, after '='");
  EXPECT_EQ(read_error("t.tps", "ID=A\nLM=1\n1 2\n"), "t.tps:1: 'ID=A' stands before the first LM= or LM3=");
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
    EXPECT_TRUE(are_equal_but(read_one("t.tps", "LM=3\n1 2\n" + mark + " 4\n-1 -1\n").points,
                              points_2d({1, 2, kNone, 4, -1, -1}), {1}))
        << mark;
}

// ---- addresses

constexpr const char* kThreeShapes = "LM=1\n1 2\nID=apis\nLM=1\n3 4\nID=bombus\nLM=0\nID=empty\n";

TEST_F(Address, NamesOneShape) {
  write("set.tps", kThreeShapes);
  EXPECT_EQ(read_landmarks("set.tps#1").points, Eigen::Vector2d(1, 2));
  const Landmarks shape = read_landmarks("set.tps#id=bombus");
  EXPECT_EQ(shape.points, Eigen::Vector2d(3, 4));
  EXPECT_EQ(shape.name, "bombus");
  EXPECT_EQ(shape.source, "set.tps#id=bombus");
}

TEST_F(Address, MayHoldMoreSigns) {
  write("a#1.tps", "LM=1\n1 2\nID=apis#7\nLM=1\n3 4\n");
  write("b#2.csv", "5,6\n");
  EXPECT_EQ(read_landmarks("a#1.tps#id=apis#7").points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(read_landmarks("a#1.tps#2").points, Eigen::Vector2d(3, 4));
  EXPECT_EQ(read_landmarks("b#2.csv").points, Eigen::Vector2d(5, 6));
  EXPECT_EQ(read_landmarks("b#2.csv#1").points, Eigen::Vector2d(5, 6));
}

TEST_F(Address, PassesWarningsOn) {
  write("a.tps", "LM=1\n1 2\nSCALE=1\n");
  std::vector<std::string> warnings = {"before"};
  read_landmarks("a.tps", &warnings);
  EXPECT_THAT(warnings, ElementsAre("before", HasSubstr("SCALE is recorded")));
}

TEST_F(Address, ThatNamesNoShapeIsRefused) {
  write("set.tps", kThreeShapes);
  EXPECT_EQ(address_error("set.tps"), "set.tps has 3 shapes; choose one as set.tps#1 or set.tps#id=apis");
  EXPECT_EQ(address_error("set.tps#0"), "set.tps has 3 shapes, counted from 1; there is no #0");
  EXPECT_EQ(address_error("set.tps#7"), "set.tps has 3 shapes, counted from 1; there is no #7");
  EXPECT_THAT(address_error("set.tps#99999999999999999999999"), StartsWith("set.tps has 3 shapes, counted from 1;"));
  EXPECT_EQ(address_error("set.tps#3"), "set.tps#3: this shape has no landmarks");
  EXPECT_EQ(address_error("set.tps#id=bombux"), "set.tps has no shape named 'bombux'; did you mean 'bombus'?");
  EXPECT_EQ(address_error("set.tps#id=Xylocopa"), "set.tps has no shape named 'Xylocopa'; it has apis, bombus, empty");
  for (const std::string selector : {"", "-1", "two", "1x", "name=apis"})
    EXPECT_EQ(
        address_error("set.tps#" + selector),
        "'" + selector + "' follows '#' in the address of a shape in set.tps; a number from 1 or id=NAME is needed");
}

TEST_F(Address, ThatNamesSeveralShapesIsRefused) {
  std::string text;
  for (int i = 0; i < 12; ++i) text += "LM=1\n1 2\nID=same\n";
  write("set.tps", text);
  EXPECT_EQ(
      address_error("set.tps#id=same"),
      "set.tps has 12 shapes named 'same': #1, #2, #3, #4, #5, #6, #7, #8, #9, #10, ... (12 in all); choose one by "
      "its number");
}

// ---- files that cannot be read

TEST_F(Unreadable, IsRefused) {
  EXPECT_EQ(address_error("none.csv"), "cannot read 'none.csv': No such file or directory");
  EXPECT_EQ(address_error("none.csv#2"), "cannot read 'none.csv': No such file or directory");
  fs::create_directory("folder.csv");
  EXPECT_EQ(address_error("folder.csv"), "cannot read 'folder.csv': it is a folder; a file is needed");
  EXPECT_EQ(read_error("empty.csv", ""), "empty.csv is empty");
  EXPECT_EQ(read_error("blank.tps", "\r\n \n"), "blank.tps is empty");
  EXPECT_EQ(read_error("utf16.csv", std::string("x\0,\0y\0", 6)),
            "utf16.csv is not a text file (it holds a zero byte); text must be in UTF-8");
  EXPECT_EQ(read_error("notes.txt", "Landmark 1 is the tip\n"),
            "notes.txt is in none of the landmark formats (tps, vtk, csv); it begins with 'Landmark 1 is the tip'");
}

TEST(LandmarkFormats, DescribeThemselves) {
  for (const LandmarkFormat& format : landmark_formats()) {
    EXPECT_FALSE(format.name.empty());
    EXPECT_FALSE(format.extensions.empty());
    EXPECT_FALSE(format.help.empty());
    EXPECT_FALSE(format.sniff("")) << format.name;
    EXPECT_FALSE(format.sniff(std::string_view("\0\1\2", 3))) << format.name;
  }
}

}  // namespace
}  // namespace pulson
