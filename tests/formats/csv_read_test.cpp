// csv: tables of one landmark per line.

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
using testing::StartsWith;

using CsvFile = ReadingFiles;

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
      "\xEF\xBB\xBF\xEF\xBB\xBFx,y\n1.5,-2\n300,0.25\n",
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

TEST_F(CsvFile, TellsWhereACommentLooksLikeARow) {
  EXPECT_THAT(
      read("t.csv", "specimen,x,y\na,1,2\n#3,3,4\nb,5,6\n#4,7,8\n").warnings,
      ElementsAre("t.csv:3: this line looks like a row, but begins with the mark of a comment and is left out; a "
                  "name that begins so needs quotes"));
  for (const std::string text : {"#1,2,3\nlabel,x,y\na,1,2\n# by hand, 2024\n#\n", "label,x,y\n\"#3\",1,2\n"})
    EXPECT_THAT(read("t.csv", text).warnings, testing::IsEmpty()) << text;
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
  EXPECT_THAT(read_one("quote.csv", "name,x\r\n\"a\r\nb\" ,1\r\n\"\n\n#c\",\" 2 \"\r\n").labels,
              ElementsAre("a\r\nb", "\n\n#c"));
  EXPECT_THAT(read_one("quote.csv", "\"my\nname\";landmark;x\na;\" tip\";1\nb;tip ;2\n").labels,
              ElementsAre(" tip", "tip"));
  EXPECT_THAT(read_one("quote.csv", "name x\n\"a\nb\" 1  \n\"c d\" 2\n").labels, ElementsAre("a\nb", "c d"));
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
              ElementsAre("w.csv: columns that are not used: 'weight'"));
  EXPECT_THAT(read("w.csv", "5\n7\n6\n").warnings,
              ElementsAre("w.csv: one column without a header, read as 3 landmarks on a line (1D)"));
  EXPECT_THAT(read("w.csv", "5\n70\n6\n72\n8\n75\n9\n71\n").warnings,
              ElementsAre("w.csv: one column without a header, read as 8 landmarks on a line (1D); if it holds x and y "
                          "in turn, use `dimension = 2`"));
  EXPECT_THAT(read("w.csv", "1\n2\n4\n5\n7\n6\n9\n8\n").warnings,
              ElementsAre("w.csv: one column without a header, read as 8 landmarks on a line (1D)"));
  EXPECT_THAT(
      read("w.csv", "1,5\n2,7\n3,9\n").warnings,
      ElementsAre("w.csv: the first column counts the lines and is read as the coordinate x; if it is an index, "
                  "give the table a header such as id,x,y"));
}

// ---- csv: what is refused

TEST_F(CsvFile, RefusesTablesWithoutCoordinates) {
  EXPECT_EQ(read_error("mice_groups.csv", "specimen,group\n1,c\n2,c\n"),
            "mice_groups.csv:1: no coordinates in the columns 'specimen', 'group'; a landmark table has columns "
            "x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds several shapes; "
            "`columns` names others");
  EXPECT_THAT(read_error("wide.csv", "id,A1,B1,A2,B2,A3,B3\na,1,2,3,4,5,6\n"),
              StartsWith("wide.csv:1: no coordinates in the columns 'id', 'A1', 'B1', 'A2', 'B2', 'A3', ...;"));
  EXPECT_THAT(read_error("t.csv", "x,z\n1,2\n"), StartsWith("t.csv:1: there is a column 'z' but none for y;"));
  EXPECT_THAT(read_error("t.csv", "name,Y\na,2\n"), StartsWith("t.csv:1: there is a column 'Y' but none for x;"));
}

TEST_F(CsvFile, RefusesAmbiguousColumns) {
  EXPECT_EQ(read_error("t.csv", "x,y,X\n1,2,3\n"), "t.csv:1: the columns 'x' and 'X' mean the same; give only one");
  EXPECT_EQ(read_error("t.csv", "id,landmark,x,y\n1,2,3,4\n"),
            "t.csv:1: the columns 'id' and 'landmark' mean the same; give only one; call the one that names the "
            "specimen 'specimen'");
  EXPECT_EQ(read_error("t.csv", "landmark,x,y\n1,2,3\n2,4,5\n1,6,7\n"),
            "t.csv:4: landmark '1' is already on line 2; labels must differ within a shape, a column specimen "
            "distinguishes shapes and a column group distinguishes outlines");
  EXPECT_THAT(read_error("t.csv", "specimen,landmark,x\nA,1,2\nA,1,3\n"),
              StartsWith("t.csv:3: landmark '1' of specimen 'A' is already on line 2;"));
  EXPECT_EQ(read_error("t.csv", "specimen,landmark,x,y\n,1,2,3\nA,2,4,5\n"),
            "t.csv:2: the specimen is empty; each line needs one");
  EXPECT_EQ(read_error("t.csv", "specimen,landmark,x,y\nA,1,2,3\nA,2,2,3\n,3,4,5\n"),
            "t.csv:4: the specimen is empty; each line needs one");
}

TEST_F(CsvFile, RefusesLinesThatDoNotFit) {
  EXPECT_EQ(read_error("t.csv", "x,y\n1,2\n\n1,2,3\n"),
            "t.csv:4: 3 columns, but line 1 has 2; all lines must have the same number");
  EXPECT_EQ(read_error("t.csv", "1,2\n3\n"),
            "t.csv:2: 1 column, but line 1 has 2; all lines must have the same number");
  EXPECT_EQ(
      read_error("t.csv", "1,2,3,4\n"),
      "t.csv:1: 4 columns without a header; a table without one has the columns x[,y[,z]], one landmark per line");
  EXPECT_EQ(read_error("t.csv", "\"Pt-0\",\"true\",47.5,3\n"),
            "t.csv:1: 'Pt-0' is not a number; a table with more than coordinates needs a header such as label,x,y");
  EXPECT_EQ(read_error("t.csv", "x,y\n1,\"2\n"),
            "t.csv:2: broken quotes in '1,\"2'; a field in quotes is \"like this\"");
  EXPECT_EQ(read_error("t.csv", "label,x\na,1\n\"b,2\nc,3\n"),
            "t.csv:3: broken quotes in '\"b,2'; a field in quotes is \"like this\"");
  EXPECT_EQ(read_error("t.csv", "label,x\n\"a\nb\",1\nc,d\n"), "t.csv:4: landmark 'c': x is 'd'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x,y\n\"1\"2,3\n"),
            "t.csv:2: broken quotes in '\"1\"2,3'; a field in quotes is \"like this\"");
  EXPECT_EQ(read_error("t.csv", "x,y\n"), "t.csv holds a header and no landmarks");
  EXPECT_EQ(read_error("t.csv", "# nothing\n\n"),
            "t.csv holds only blank lines and comments; it needs lines x[,y[,z]]");
}

TEST_F(CsvFile, RefusesWhatIsNoNumber) {
  EXPECT_EQ(read_error("t.csv", "x,y\n1,2\n3,four\n"), "t.csv:3: landmark 2: y is 'four'; a number is needed");
  EXPECT_EQ(read_error("t.csv", "x;y\n1,5;2.5\n"), "t.csv:2: landmark 1: x is '1,5'; a number is needed");
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

TEST_F(CsvFile, TakesMarksOfMissingCoordinates) {
  for (const std::string mark : {"NA", "", "NaN", "nan", "-nan", "null", "-", "?", "."})
    EXPECT_TRUE(
        have_same_bits(read_one("t.csv", "x,y\n1,2\n3," + mark + "\n5,6\n").points, points_2d({1, 2, 3, kNone, 5, 6})))
        << mark;
  const LandmarkFile file = read("t.csv", "specimen,landmark,x,y\nA,1,2,3\nA,tip,NA,NA\nB,1,NA,7\n");
  EXPECT_TRUE(have_same_bits(file.shapes[0].points, points_2d({2, 3, kNone, kNone})));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("1", "tip"));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({kNone, 7})));
}

TEST_F(CsvFile, IsRecognisedWithMissingCoordinates) {
  const Points expected = points_2d({kNone, kNone, 1, 2});
  for (const std::string text : {"NA,NA\n1,2\n", "NA NA\n1 2\n", "nan\tnan\n1\t2\n", "x,y\nNA,NA\n1,2\n"}) {
    const LandmarkFile file = read("points.txt", text);
    EXPECT_EQ(file.format, "csv") << text;
    EXPECT_TRUE(have_same_bits(file.shapes.front().points, expected)) << text;
  }
  EXPECT_TRUE(have_same_bits(read_one("points.txt", "NA,5\n1,2\n").points, points_2d({kNone, 5, 1, 2})));
  EXPECT_TRUE(have_same_bits(read_one("all.csv", "NA,NA\n").points, points_2d({kNone, kNone})));
  EXPECT_THAT(read_error("notes.txt", "-\nfirst, a line of text\n"),
              HasSubstr("is not in any of the landmark formats"));
}

}  // namespace
}  // namespace pulson::formats
