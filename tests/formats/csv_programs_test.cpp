// csv: tables as Excel, R, ImageJ, Slicer, napari and ParaView write them.

#include <string>

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

class ReadingProgramTables : public ReadingTexts {
 protected:
  static std::string read_error(const std::string& text) { return ReadingFiles::read_error("t.csv", text); }

  static void expect_pair(const std::string& text) {
    const LandmarkFile file = read(text);
    ASSERT_EQ(file.shapes.size(), 1U) << text;
    EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4})) << text;
    EXPECT_THAT(file.shapes.front().labels, IsEmpty()) << text;
    EXPECT_THAT(file.warnings, IsEmpty()) << text;
  }
};

using ExcelTables = ReadingProgramTables;
using RTables = ReadingProgramTables;
using ProgramTables = ReadingProgramTables;

// ---- Excel

TEST_F(ExcelTables, MayEndInEmptyRowsAndColumns) {
  for (const std::string text : {"x,y\n1,2\n3,4\n,\n,\n", "x,y,,\n1,2,,\n3,4,,\n,,,\n", "x,y\n1,2,\n3,4,\n",
                                 "1,2,\n3,4,\n", "x;y;\n1;2;\n3;4;\n", "x\ty\t\n1\t2\t\n3\t4\t\n", "1\t2\t\n3\t4\t\n"})
    expect_pair(text);
  EXPECT_EQ(read("id,x1,y1\na,1,2\n,,\n").shapes.size(), 1U);
  EXPECT_EQ(read("specimen,landmark,x,y\na,1,1,2\n,,,\n").shapes.front().points, points_2d({1, 2}));
  EXPECT_TRUE(have_same_bits(read("x,y\n1,2\nNA,NA\n").shapes.front().points, points_2d({1, 2, kNone, kNone})));
  EXPECT_TRUE(have_same_bits(read("id,x1,y1\na,,\n").shapes.front().points, points_2d({kNone, kNone})));
}

TEST_F(ExcelTables, AreDoubtedWhereRowsAmongOthersAreEmpty) {
  const LandmarkFile file = read("x,y\n1,2\n,\n3,4\n");
  EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(file.warnings,
              ElementsAre("t.txt:4: the empty cells above this line are no landmark; a missing one is written NA"));
  EXPECT_THAT(read("label,x,y\na,1,2\n,,\nb,3,4\n").warnings, IsEmpty());
}

TEST_F(ExcelTables, MayNameTheirDelimiter) {
  expect_pair("sep=;\r\nx;y\r\n1;2\r\n3;4\r\n");
  expect_pair("\"sep=,\"\n1,2\n3,4\n");
  expect_pair("\xEF\xBB\xBFsep=|\nx|y\n1|2\n3|4\n");
}

TEST_F(ExcelTables, HaveMarksOfTheirOwnForMissingValues) {
  for (const std::string mark : {"#N/A", "#NA", "<NA>"})
    EXPECT_TRUE(have_same_bits(read("x,y\n1,2\n" + mark + "," + mark + "\n").shapes.front().points,
                               points_2d({1, 2, kNone, kNone})))
        << mark;
}

TEST_F(ExcelTables, WithBlankLinesBetweenBlocksAreDoubted) {
  EXPECT_THAT(read("5,2\n3,4\n\n5,6\n7,8\n").warnings,
              ElementsAre("t.txt: blank lines split the table into 2 blocks of 2 lines, which are read as one shape; a "
                          "column specimen distinguishes shapes"));
  EXPECT_THAT(read("5,2\n\n3,4\n\n5,6\n").warnings, IsEmpty());
  EXPECT_THAT(read("label,x,y\na,5,2\nb,3,4\n\nc,5,6\nd,7,8\n").warnings, IsEmpty());
}

// ---- R

TEST_F(RTables, MayHaveRowNamesWithoutAHeader) {
  expect_pair("\"x\" \"y\"\n\"1\" 1 2\n\"2\" 3 4\n");
  expect_pair("x,y\n1,1,2\n2,3,4\n");
  const Landmarks named = read("\"X\" \"Y\" \"Z\"\n\"nasion\" 1 2 3\n\"bregma\" 4 5 6\n").shapes.front();
  EXPECT_THAT(named.labels, ElementsAre("nasion", "bregma"));
  EXPECT_EQ(named.points.col(1), Eigen::Vector3d(4, 5, 6));
  const LandmarkFile wide = read("x1 y1 x2 y2\nA 1 2 3 4\nB 5 6 7 8\n");
  EXPECT_EQ(wide.shapes[1].name, "B");
  EXPECT_EQ(wide.shapes[1].points, points_2d({5, 6, 7, 8}));
}

TEST_F(RTables, WithoutRowNamesAreRefusedWhereLinesAreLonger) {
  EXPECT_THAT(read_error("x,y\n1.5,1,2\n2.5,3,4\n"), HasSubstr("t.csv:2: 3 columns, but line 1 has 2;"));
  EXPECT_THAT(read_error("x,y\n7,1,2\n7,3,4\n"), HasSubstr("t.csv:2: 3 columns, but line 1 has 2;"));
}

TEST_F(RTables, MayLeaveCoordinatesUnnamed) {
  expect_pair("\"\",\"V1\",\"V2\"\n\"1\",1,2\n\"2\",3,4\n");
  expect_pair("V1,V2\n1,2\n3,4\n");
  for (const std::string text : {"V1\tV2\tV3\ntip\t1\t2\t3\nbase\t4\t5\t6\n", "V1,V2,V3,V4\ntip,1,2,3\nbase,4,5,6\n"}) {
    const Landmarks shape = read(text).shapes.front();
    EXPECT_THAT(shape.labels, ElementsAre("tip", "base")) << text;
    EXPECT_EQ(shape.points.col(1), Eigen::Vector3d(4, 5, 6)) << text;
  }
  EXPECT_EQ(read("id,V1,V2,V3,V4\na,1,2,3,4\n").shapes.front().points, points_2d({1, 2, 3, 4})) << "a shape per line";
  EXPECT_THAT(read_error("V1,V2\nage,2\n"), HasSubstr("t.csv:1: no coordinates in the columns"));
}

// ---- Slicer, napari, ParaView, ImageJ

TEST_F(ProgramTables, OfSlicerSayWhereAxesPoint) {
  const LandmarkFile file = read("label\tl\tp\ts\tdefined\nF-1\t1\t2\t3\t1\nF-2\t0\t0\t0\t0\n");
  EXPECT_EQ(file.axes, "LPS");
  EXPECT_THAT(file.shapes.front().labels, ElementsAre("F-1", "F-2"));
  EXPECT_TRUE(have_same_bits(file.shapes.front().points, (Points(3, 2) << 1, kNone, 2, kNone, 3, kNone).finished()));
  EXPECT_THAT(file.warnings, IsEmpty());
  const LandmarkFile ras = read("label,r,a,s\nF-1,1,2,3\n");
  EXPECT_EQ(ras.axes, "RAS");
  EXPECT_EQ(ras.shapes.front().points, Eigen::Vector3d(1, 2, 3));
}

TEST_F(ProgramTables, OfNapariHaveRowsFirst) {
  const LandmarkFile file = read("index,axis-0,axis-1\n0,2,1\n1,4,3\n");
  EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(file.shapes.front().labels, IsEmpty());
  EXPECT_THAT(file.warnings,
              ElementsAre("t.txt: the columns axis-0, axis-1 are read as y, x, as napari counts rows first"));
  EXPECT_EQ(read("axis-0,axis-1,axis-2\n3,2,1\n").shapes.front().points, Eigen::Vector3d(1, 2, 3));
}

TEST_F(ProgramTables, OfParaViewHavePoints) {
  EXPECT_EQ(read("\"Points:0\",\"Points:1\",\"Points:2\"\n1,2,3\n").shapes.front().points, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read("Points_0,Points_1,Points_2\n1,2,3\n").shapes.front().points, Eigen::Vector3d(1, 2, 3));
}

TEST_F(ProgramTables, OfImageJNameTheImageInEachLine) {
  const LandmarkFile file = read(" ,Label,X,Y\n1,a.tif,1,2\n2,a.tif,3,4\n3,b.tif,5,6\n4,b.tif,7,8\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "a.tif");
  EXPECT_EQ(file.shapes[1].points, points_2d({5, 6, 7, 8}));
  EXPECT_THAT(file.shapes[1].labels, IsEmpty());
  EXPECT_THAT(file.warnings,
              ElementsAre("t.txt: the values of the column 'Label' repeat in runs; it is read as the specimen"));
  EXPECT_EQ(read(" ,Label,X,Y\n1,a.tif,1,2\n2,a.tif,3,4\n").shapes.front().name, "a.tif");
  EXPECT_THAT(read_error("label,x,y\nnose,1,2\nnose,3,4\ntail,5,6\n"),
              HasSubstr("landmark 'nose' is already on line 2"));
  EXPECT_EQ(read("label,x,y,group\na,1,2,1\nb,3,4,1\na,5,6,2\nb,7,8,2\n").shapes.size(), 1U);
  EXPECT_EQ(read("Slice,X,Y,C-pos,Z-pos\n1,1,2,1,1\n").shapes.front().points, points_2d({1, 2}));
}

TEST_F(ProgramTables, MayNameColumnsInAComment) {
  const LandmarkFile file = read("# y,x,t\n2,1,0\n4,3,0\n");
  EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: columns that are not used: 't'"));
  EXPECT_EQ(read("//X Y Z\n1 2 3\n").shapes.front().points, Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace pulson::formats
