// csv: names of columns of tables with a landmark per line.

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

class ColumnNames : public ReadingTexts {
 protected:
  static std::string read_error(const std::string& text) { return ReadingFiles::read_error("t.csv", text); }

  static void expect_two_pairs(const std::string& text) {
    const LandmarkFile file = read(text);
    ASSERT_EQ(file.shapes.size(), 2U) << text;
    EXPECT_EQ(file.shapes[0].name, "A") << text;
    EXPECT_EQ(file.shapes[1].name, "B") << text;
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4})) << text;
    EXPECT_EQ(file.shapes[1].points, points_2d({5, 6, 7, 8})) << text;
    EXPECT_THAT(file.shapes[1].labels, IsEmpty()) << text;
  }
};

TEST_F(ColumnNames, TellSpecimensAndLandmarks) {
  for (const std::string header :
       {"SpecimenID,LM", "specimen.ID,Landmark", "Specimen ID,lm", "sample,landmark", "individual,point", "ind,index",
        "spec,no", "subject,nr", "file,number", "filename,landmark_no", "file_name,landmark_number",
        "image,Landmark ID", "image_name,keypoint", "img,landmark", "frame,landmark", "image_id,landmark",
        "name,landmark", "id,landmark", "ID,LM"})
    expect_two_pairs(header + ",x,y\nA,1,1,2\nA,2,3,4\nB,1,5,6\nB,2,7,8\n");
  expect_two_pairs("image_name,x,y\nA,1,2\nA,3,4\nB,5,6\nB,7,8\n");
  expect_two_pairs(",sample,x,y\n0,A,1,2\n1,A,3,4\n2,B,5,6\n3,B,7,8\n");
}

TEST_F(ColumnNames, MayStandInTheFirstRowOfASpecimen) {
  expect_two_pairs("specimen.ID,LM,x,y\nA,1,1,2\n,2,3,4\nB,1,5,6\n,2,7,8\n");
}

TEST_F(ColumnNames, TellImages) {
  const LandmarkFile file = read("file,landmark,x,y\na.jpg,1,1,2\na.jpg,2,3,4\nb,1,1,2\n");
  EXPECT_EQ(file.shapes[0].name, "a.jpg");
  EXPECT_EQ(file.shapes[0].image, "a.jpg");
  EXPECT_EQ(file.shapes[1].image, "");
  const LandmarkFile both = read("specimen,image,landmark,x,y\nA,a.jpg,1,1,2\nA,a.jpg,2,3,4\n");
  EXPECT_EQ(both.shapes.front().name, "A");
  EXPECT_EQ(both.shapes.front().image, "a.jpg");
}

TEST_F(ColumnNames, TellSpecimensTogetherWhereOneDoesNot) {
  const LandmarkFile file = read("individual,frame,point,x,y\nm,0,nose,1,2\nm,1,nose,3,4\n");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[1].name, "m/1");
}

TEST_F(ColumnNames, MayCountLandmarksBesideTheirLabels) {
  const LandmarkFile file = read("ID,Label,X,Y\n1,nose,1,2\n2,tail,3,4\n");
  EXPECT_THAT(file.shapes.front().labels, ElementsAre("nose", "tail"));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: columns that are not used: 'ID'"));
}

TEST_F(ColumnNames, AreRefusedWhereAnotherColumnMayTellShapesApart) {
  const std::string rows = "\nvag,1,2\nvag,3,4\nimp,5,6\nimp,7,8\n";
  EXPECT_EQ(
      read_error("species,x,y" + rows),
      "t.csv:1: the values of the column 'species' repeat in runs: call it 'specimen' if it distinguishes shapes, "
      "'group' if it distinguishes outlines, otherwise remove it");
  EXPECT_EQ(read("species,x,y\nvag,1,2\nvag,3,4\n").shapes.front().count(), 2);
  EXPECT_EQ(read("label,side,x,y\na,l,1,2\nb,l,3,4\nc,r,5,6\nd,r,7,8\n").shapes.front().count(), 4);
}

TEST_F(ColumnNames, TellCoordinatesInManyWays) {
  for (const std::string header : {"Xcoord,Ycoord", "X coordinate,Y coordinate", "X_coord,Y_coord", "pos_x,pos_y",
                                   "Position X,Position Y", "coord_x,coord_y"}) {
    const LandmarkFile file = read(header + "\n1,2\n3,4\n");
    EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4})) << header;
    EXPECT_EQ(file.units, "") << header;
  }
  EXPECT_EQ(read("x,y,pos_x,pos_y\n1,2,8,9\n").shapes.front().points, points_2d({1, 2}));
  EXPECT_EQ(read("id,x1,y1,pos_x,pos_y\nA,1,2,8,9\n").shapes.front().points, points_2d({1, 2}));
}

TEST_F(ColumnNames, TellUnits) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"X (mm),Y (mm)", "mm"}, {"X [px],Y [px]", "px"},        {"x_mm,y_mm", "mm"},
      {"x_px,y_px", "px"},     {"x [\xC2\xB5m],y [um]", "um"}, {"X pixels,Y pixels", "px"}};
  for (const auto& [header, units] : cases) {
    const LandmarkFile file = read(header + "\n1,2\n3,4\n");
    EXPECT_EQ(file.shapes.front().points, points_2d({1, 2, 3, 4})) << header;
    EXPECT_EQ(file.units, units) << header;
  }
  EXPECT_EQ(read("x,y,x_mm,y_mm\n1,2,8,9\n").units, "");
  EXPECT_EQ(read_error("x_mm,y_cm\n1,2\n"), "t.csv:1: the columns 'x_mm' and 'y_cm' are not in the same units");
}

}  // namespace
}  // namespace pulson::formats
