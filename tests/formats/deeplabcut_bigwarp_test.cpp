// Tables of DeepLabCut and BigWarp.

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

class ReadingTables : public ReadingTexts {
 protected:
  static std::string read_error(const std::string& text, const std::string& name = "t.csv") {
    return ReadingFiles::read_error(name, text);
  }
};

using DeepLabCut = ReadingTables;
using BigWarp = ReadingTables;

// ---- DeepLabCut

TEST_F(DeepLabCut, HoldsAShapePerImage) {
  const LandmarkFile file = read(
      "scorer,me,me,me,me\nbodyparts,hand,hand,tip,tip\ncoords,x,y,x,y\nvideo/img1.png,1,2,,\n"
      "video\\img2.png,3,4,5,6\n");
  EXPECT_EQ(file.format, "deeplabcut");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_TRUE(have_same_bits(file.shapes[0].points, points_2d({1, 2, kNone, kNone})));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("hand", "tip"));
  EXPECT_THAT(file.shapes[0].groups, IsEmpty());
  EXPECT_EQ(file.shapes[0].image, "video/img1.png");
  EXPECT_EQ(file.shapes[0].name, "img1");
  EXPECT_EQ(file.shapes[1].image, "video\\img2.png");
  EXPECT_EQ(file.shapes[1].name, "img2");
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(DeepLabCut, HoldsIndividualsAsGroups) {
  const LandmarkFile file = read(
      "scorer,,,me,me,me,me\nindividuals,,,one,one,two,two\nbodyparts,,,tip,tip,tip,tip\ncoords,,,x,y,x,y\n"
      "labeled-data,video,img033.png,1,2,3,4\n");
  const Landmarks& shape = file.shapes.front();
  EXPECT_EQ(shape.points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(shape.image, "labeled-data/video/img033.png");
  EXPECT_EQ(shape.name, "img033");
  EXPECT_THAT(shape.labels, ElementsAre("tip", "tip"));
  EXPECT_THAT(shape.groups, ElementsAre("one", "two"));
}

TEST_F(DeepLabCut, HoldsPredictionsByFrame) {
  const LandmarkFile file =
      read("scorer,net,net,net\nbodyparts,tip,tip,tip\ncoords,x,y,likelihood\n0,1,2,0.9\n1,3,4,0.1\n");
  EXPECT_EQ(file.shapes[1].points, points_2d({3, 4}));
  EXPECT_EQ(file.shapes[1].name, "1");
  EXPECT_EQ(file.shapes[1].image, "");
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: likelihood is not used (1 column); all landmarks are read"));
}

TEST_F(DeepLabCut, MayHaveRowsOfEmptyCells) {
  const LandmarkFile file = read("scorer,me,me\nbodyparts,tip,tip\ncoords,x,y\n,,\n0,1,2\n1,NA,NA\n,,\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2}));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({kNone, kNone})));
}

TEST_F(DeepLabCut, IsRefusedWhereItsHeaderDoesNotFit) {
  const std::string begin = "scorer,me,me\nbodyparts,tip,tip\n";
  EXPECT_EQ(read_error(begin),
            "t.csv:1: a table of DeepLabCut begins with the lines scorer, bodyparts and coords, with individuals after "
            "scorer where there are several");
  EXPECT_EQ(read_error(begin + "coords,x,y\n"), "t.csv holds a header and no landmarks");
  EXPECT_EQ(read_error(begin + "coords,x,x\na.png,1,2\n"), "t.csv:3: the columns 2 and 3 are both x of 'tip'");
  EXPECT_EQ(read_error(begin + "coords,x,w\na.png,1,2\n"), "t.csv:3: column 3 is 'w'; valid: x, y, z, likelihood");
  EXPECT_EQ(read_error("scorer,me,me\nbodyparts,tip,hand\ncoords,x,y\na.png,1,2\n"),
            "t.csv:3: no column holds y of 'tip'");
  EXPECT_EQ(read_error(begin + "coords,likelihood,likelihood\na.png,1,2\n"), "t.csv:3: no column holds x");
  EXPECT_EQ(read_error(begin + "coords,x,y\na.png,1,far\n"),
            "t.csv:4: landmark 'tip' of 'a': y is 'far'; a number is needed");
  EXPECT_EQ(read_error(begin + "coords,x,y\na.png,1\n"),
            "t.csv:4: 2 columns, but line 1 has 3; all lines must have the same number");
  EXPECT_EQ(read_error(begin + "coords,,\na.png,1,2\n"), "t.csv:3: no column holds x");
  const std::string name(201, 'a');
  EXPECT_EQ(read_error("scorer,me,me\nbodyparts," + name + "," + name + "\ncoords,x,y\na.png,1,2\n"),
            "t.csv:2: the name '" + std::string(60, 'a') + "...' is longer than 200 bytes");
}

// ---- BigWarp

TEST_F(BigWarp, HoldsMovingAndTarget) {
  const LandmarkFile file =
      read("\"Pt-0\",\"true\",\"1\",\"2\",\"3\",\"4\"\n\"Pt-1\",\"true\",\"5\",\"6\",\"7\",\"8\"\n");
  EXPECT_EQ(file.format, "bigwarp");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "moving");
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 5, 6}));
  EXPECT_EQ(file.shapes[1].name, "target");
  EXPECT_EQ(file.shapes[1].points, points_2d({3, 4, 7, 8}));
  EXPECT_THAT(file.shapes[1].labels, ElementsAre("Pt-0", "Pt-1"));
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(BigWarp, MissesPointsThatAreNotSetOrNotActive) {
  const LandmarkFile file = read("a,true,1,2,3,Infinity,-Infinity,Infinity\nb,false,1,2,3,4,5,6\n");
  EXPECT_TRUE(have_same_bits(file.shapes[0].points, (Points(3, 2) << 1, kNone, 2, kNone, 3, kNone).finished()));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, Points::Constant(3, 2, kNone)));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: 1 inactive landmark read as missing"));
}

TEST_F(BigWarp, KnowsLandmarksByNumberWhereNamesRepeat) {
  const LandmarkFile file = read("Pt-1,true,1,2,3,4\nPt-1,true,5,6,7,8\n");
  EXPECT_THAT(file.shapes[0].labels, IsEmpty());
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: the name 'Pt-1' repeats; landmarks are known by their number"));
}

// A row as BigWarp itself writes it: all cells in quotes; what waits for its place is Infinity and not active.
TEST_F(BigWarp, IsWrittenAsBigWarpWritesIt) {
  LandmarkFile file;
  file.shapes.resize(2);
  file.shapes[0].points = points_2d({1, 2, 5.5, 6});
  file.shapes[1].points = points_2d({3, 4, kNone, kNone});
  file.shapes[1].labels = {"the \"tip\"", "b"};
  const LandmarkFormat& format = landmark_format_to_write("leaf.bigwarp.csv");
  EXPECT_EQ(format.name, "bigwarp");
  const WrittenLandmarks written = format.write("t.csv", file);
  EXPECT_EQ(
      written.text,
      "\"the "
      "\"\"tip\"\"\",\"true\",\"1\",\"2\",\"3\",\"4\"\n\"b\",\"false\",\"5.5\",\"6\",\"Infinity\",\"Infinity\"\n");
  EXPECT_THAT(written.losses, IsEmpty());
  EXPECT_TRUE(have_same_bits(format.read("t.csv", written.text).shapes[0].points, file.shapes[0].points));
  file.shapes.pop_back();
  EXPECT_EQ(error_of([&] { format.write("t.csv", file); }),
            "t.csv: bigwarp holds two shapes, moving and target; there is 1");
}

TEST_F(BigWarp, IsRefusedWhereLinesDoNotFit) {
  EXPECT_EQ(read_error("a,true,1,2,3,4\nb,yes,5,6,7,8\n"), "t.csv:2: 'yes' in the second column; valid: true, false");
  EXPECT_EQ(read_error("a,true,1,2,3,4\nb,true,5,6,7\n"),
            "t.csv:2: 5 columns, but line 1 has 6; all lines must have the same number");
  EXPECT_EQ(read_error("a,true,1,2,3,4\nb,true,5,6,far,8\n"),
            "t.csv:2: landmark 'b' of target: x is 'far'; a number is needed");
}

}  // namespace
}  // namespace pulson::formats
