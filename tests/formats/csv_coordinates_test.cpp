// csv: tables whose columns only count the coordinates, that end in a centroid size or in summaries, or hold slices.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

using SizeRows = ReadingTexts;
using NumberedColumnsOfTables = ReadingTexts;
using StackTables = ReadingTexts;
using SummaryRows = ReadingTexts;

// ---- x1 y1 x2 y2 ... CS

TEST_F(SizeRows, AreShapesWhereTheLastNumberIsTheirSize) {
  // right triangles of legs 3 and 6: sqrt(6 + 6) and sqrt(24 + 24)
  for (const std::string text : {"0 0 3 0 0 3 3.4641\n1 1 7 1 1 7 6.9282\n", "0,0,3,0,0,3,3.4641\n"}) {
    const LandmarkFile file = read(text);
    EXPECT_EQ(file.shapes.front().points, points_2d({0, 0, 3, 0, 0, 3})) << text;
    EXPECT_THAT(file.shapes.front().properties, ElementsAre(Pair("CS", "3.4641")));
    EXPECT_THAT(file.warnings,
                ElementsAre(HasSubstr("7 numbers per line without a header, read as shapes of 3 landmarks "
                                      "in 2D; the last is their centroid size")));
  }
  EXPECT_EQ(read("0 0 0 3 0 0 0 3 0 3.4641\n").shapes.at(0).points.col(2), Eigen::Vector3d(0, 3, 0));
}

TEST_F(SizeRows, AreShapesWhereTheyWereSuperimposed) {
  const LandmarkFile file =
      read("-0.5 -0.5 0.5 -0.5 0.01 0.6 120\n-0.5 -0.5 0.5 -0.5 0.02 0.7 110\n-0.5 -0.5 0.5 -0.5 0.03 0.65 130\n");
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[1].points, points_2d({-0.5, -0.5, 0.5, -0.5, 0.02, 0.7}));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("taken for the centroid size before they were superimposed")));
}

TEST_F(SizeRows, AreNoAxesAndNoGuess) {
  EXPECT_EQ(read("0 3 0 1 2\n0 0 3 1 2\n").shapes.size(), 1U) << "all x, then all y";
  EXPECT_THAT(read_error("0 0 3 0 0 3\n0 0 3 0.1 0 3\n"), HasSubstr("2 lines of 6 numbers that are nearly the same"));
  // nine numbers, the last of which goes with nothing: three landmarks in space, or four and a size
  EXPECT_THAT(read_error("1 2 3 4 5 6 7 8 90\n1 2 3 4 5 6 7 8.1 80\n1 2 3 4 5 6 7 8.2 95\n1 2 3 4 5 6 7 8.3 70\n"),
              HasSubstr("9 columns without a header"));
}

// ---- numbered columns

TEST_F(NumberedColumnsOfTables, OfMorphoJ) {
  const LandmarkFile file = read(
      "Id\tCentroid Size\tProcCoord1\tProcCoord2\tProcCoord3\tProcCoord4\nA f 1\t9\t1\t2\t3\t4\n"
      "B m 2\t8\t5\t6\t7\t8\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "A f 1");
  EXPECT_EQ(file.shapes[1].points, points_2d({5, 6, 7, 8}));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("columns that are not used: 'Centroid Size'")));
}

TEST_F(NumberedColumnsOfTables, OfR) {
  const LandmarkFile shapes = read("\"\",\"V1\",\"V2\",\"V3\",\"V4\"\n\"a\",1,2,3,4\n\"b\",5,6,7,NA\n");
  ASSERT_EQ(shapes.shapes.size(), 2U);
  EXPECT_EQ(shapes.shapes[0].name, "a");
  EXPECT_TRUE(have_same_bits(shapes.shapes[1].points, points_2d({5, 6, 7, kNone})));
  for (const std::string header : {"\"\",\"X1\",\"X2\"", "\"\",\"V1\",\"V2\"", ",0,1", ",1,2"}) {
    const LandmarkFile points = read(header + "\n\"1\",1,2\n\"2\",3,4\n");
    ASSERT_EQ(points.shapes.size(), 1U) << header;
    EXPECT_EQ(points.shapes[0].points, points_2d({1, 2, 3, 4})) << header;
  }
}

TEST_F(NumberedColumnsOfTables, MayBeNumbersAlone) {
  for (const std::string header : {"ID\t1\t2\t3\t4", "id\t0\t1\t2\t3", "\t1\t2\t3\t4", "specimen\t1\t2\t3\t4"}) {
    const LandmarkFile file = read(header + "\nHomo f 025\t1.5\t2\t3\t4\nHomo m 026\t5\t6\t7\t8\n");
    ASSERT_EQ(file.shapes.size(), 2U) << header;
    EXPECT_EQ(file.shapes[0].name, "Homo f 025") << header;
    EXPECT_EQ(file.shapes[0].points, points_2d({1.5, 2, 3, 4})) << header;
  }
  EXPECT_EQ(read("a 1 2 3 4\nb 5 6 7 9\n").shapes.size(), 2U) << "a first line that counts by chance";
}

TEST_F(NumberedColumnsOfTables, SayTheirDimensionOrAreRefused) {
  const std::string header = "id,V1,V2,V3,V4,V5,V6,V7,V8,V9,V10,V11,V12\n";
  EXPECT_THAT(read_error(header + "a,1,2,3,4,5,6,7,8,9,10,11,13\n"),
              HasSubstr("t.txt:1: 12 coordinates in the columns 'V1' to 'V12' may be 6 landmarks in 2D or 4 in 3D; "
                        "`dimension = 2` or `dimension = 3` says which"));
  write("t.txt", header + "a,1,2,3,4,5,6,7,8,9,10,11,13\n");
  EXPECT_EQ(read_landmark_file("t.txt", {.dimension = 3}).shapes.at(0).points.col(3), Eigen::Vector3d(10, 11, 13));
  EXPECT_EQ(read_landmark_file("t.txt", {.dimension = 2}).shapes.at(0).points.col(5), Eigen::Vector2d(11, 13));
  // centred in space and not in the plane, as Procrustes coordinates are
  EXPECT_EQ(read(header + "a,1,0,0,-1,0,0,0,1,2,0,-1,-2\n").shapes.at(0).dimension(), 3);
  EXPECT_EQ(read(header + "a,1,2,-1,3,2,-1,-2,-4,0,5,0,-5\n").shapes.at(0).dimension(), 2);
  EXPECT_EQ(read("id,V1,V2,V3,V4,V5,V6\na,1,2,3,4,5,6\n").shapes.at(0).count(), 3);
  EXPECT_EQ(read("id,V1,V2,V3,V4,V5,V6,V7,V8,V9\na,1,2,3,4,5,6,7,8,9\n").shapes.at(0).count(), 3);
  EXPECT_THAT(read_error("id,V1,V2,V3,V4,V5\na,1,2,3,4,5\n"), HasSubstr("which landmarks in 2D or 3D cannot have"));
  EXPECT_EQ(read("id,x1,x2,x3,x4,y1,y2,y3,y4\na,1,2,3,4,5,6,7,8\n").shapes.at(0).points.col(1), Eigen::Vector2d(2, 6));
}

TEST_F(NumberedColumnsOfTables, MayFollowACountOfLines) {
  const LandmarkFile file =
      read("2\nlefteye_x lefteye_y nose_x nose_y \n000001.jpg  69 109  77 142\n000002.jpg  1 2  3 4\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].image, "000001.jpg");
  EXPECT_EQ(file.shapes[1].points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(file.shapes[1].labels, ElementsAre("lefteye", "nose"));
  EXPECT_TRUE(file.shapes[0].frame.y_down);
}

// ---- stacks of ImageJ

TEST_F(StackTables, HoldASpecimenForEachSlice) {
  const LandmarkFile labelled = read(
      " ,Label,X,Y,Ch,Slice,Frame,Counter,Count\n1,s.tif:1-a,15,16,1,1,1,0,3\n"
      "2,s.tif:1-a,25,36,1,1,1,0,3\n3,s.tif:2-b,15,17,1,2,1,0,3\n");
  ASSERT_EQ(labelled.shapes.size(), 2U);
  EXPECT_EQ(labelled.shapes[0].name, "s.tif:1-a");
  EXPECT_EQ(labelled.shapes[0].points, points_2d({15, 16, 25, 36}));
  EXPECT_EQ(labelled.shapes[1].points, points_2d({15, 17}));
  const LandmarkFile plain = read(" ,X,Y,Slice\n1,1,2,1\n2,3,4,1\n3,5,6,2\n4,7,8,2\n");
  ASSERT_EQ(plain.shapes.size(), 2U);
  EXPECT_EQ(plain.shapes[1].name, "2");
  EXPECT_EQ(read(" ,Label,X,Y,Ch,Slice,Frame\n1,a.tif,1,2,1,1,1\n2,a.tif,3,4,1,1,1\n").shapes.size(), 1U);
  EXPECT_EQ(read(" ,X,Y,Slice\n1,1,2,1\n2,3,4,2\n3,5,6,3\n").shapes.size(), 1U) << "a landmark on each slice";
}

TEST_F(StackTables, OfCellsAreInSpace) {
  const LandmarkFile file = read(
      "Type\tSlice\tX\tY\tValue\tC-pos\tZ-pos\tT-pos\tX(micron)\tY(micron)\tZ(micron)\n"
      "1\t1\t100\t200\t5\t1\t3\t1\t10\t20\t3\n1\t2\t120\t300\t5\t1\t5\t1\t12\t30\t5\n");
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 10, 12, 20, 30, 3, 5).finished());
  EXPECT_EQ(file.units, "um");
}

// ---- summaries

TEST_F(SummaryRows, AreNoLandmarks) {
  for (const std::string rows :
       {"1,a,1,2\n2,b,3,4\n3,Mean,2,3\n4,SD,1,1\n5,Min,1,2\n6,Max,3,4\n", "1,a,1,2\n2,b,3,4\nMean,,2,3\nSD,,1,1\n"}) {
    const LandmarkFile file = read(" ,Label,X,Y\n" + rows);
    EXPECT_EQ(file.shapes.at(0).points, points_2d({1, 2, 3, 4})) << rows;
    EXPECT_THAT(file.warnings, testing::Contains(HasSubstr("t.txt:4:"))) << rows;
  }
  EXPECT_EQ(read("label,x,y\na,1,2\nmin,3,4\nmax,5,6\n").shapes.at(0).count(), 3) << "names of landmarks";
  EXPECT_EQ(read("label,x,y\nmean,1,2\nsd,3,4\nb,5,6\n").shapes.at(0).count(), 3) << "not at the end";
}

}  // namespace
}  // namespace pulson::formats
