// Text formats that hold several specimens, or tables in sections: NTSYS, morphologika, EDMA, StereoMorph.

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
using testing::Pair;

using NtsFile = ReadingFiles;
using MorphologikaFile = ReadingFiles;
using EdmaFile = ReadingFiles;
using StereomorphFile = ReadingFiles;

// ---- NTSYS

TEST_F(NtsFile, TakesSpecimensByRows) {
  for (const std::string text : {
           "\"two rats\n\" and a comment\n1 2L 4 0 dim=2\nA B\n-.5 1 2 3\n4 5 6 7\n",
           "\"two rats\r\n1 2l 4L 0 DIM = 2\r\nA\r\nB\r\nx1 y1 x2 y2\r\n-.5 1\r\n2 3\r\n4 5\r\n6 7\r\n",
           "1 2B 4 0 dim=2\nA -.5 1 2 3\nB 4 5 6 7\n",
           "1 2E 4 0 dim=2\n-.5 1 2 3 A\n4 5 6 7 B\n",
       }) {
    const LandmarkFile file = read("rats.nts", text);
    EXPECT_EQ(file.format, "nts") << text;
    ASSERT_EQ(file.shapes.size(), 2U) << text;
    EXPECT_EQ(file.shapes[0].points, points_2d({-0.5, 1, 2, 3})) << text;
    EXPECT_EQ(file.shapes[1].points, points_2d({4, 5, 6, 7})) << text;
    EXPECT_EQ(file.shapes[0].name, "A") << text;
    EXPECT_EQ(file.shapes[1].name, "B") << text;
    EXPECT_EQ(file.warnings.size(), text.find("x1") == std::string::npos ? 0U : 1U) << text;
  }
}

TEST_F(NtsFile, TakesDtaFiles) {
  const LandmarkFile file = read("skulls.dta",
                                 "'of Landmark\n1 2L 6 1 9999 Dim=3\nskull one\nskull two\n\n1 2 3\n4 5 6\n\n"
                                 "7 8 9\n9999 9999 9999\n");
  EXPECT_EQ(file.shapes[0].name, "skull one");
  EXPECT_EQ(file.shapes[1].name, "skull two");
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, (Points(3, 2) << 7, kNone, 8, kNone, 9, kNone).finished()));
}

TEST_F(NtsFile, TakesOneSpecimenWithLandmarksByRows) {
  const Landmarks shape = read_one("wing.nts", "\"wing\n1 2L 2 0 dim=2\ntip\nbase\n1 2\nNA NA\n");
  EXPECT_TRUE(have_same_bits(shape.points, points_2d({1, 2, kNone, kNone})));
  EXPECT_THAT(shape.labels, ElementsAre("tip", "base"));
  const LandmarkFile file = read("wing.nts", "1 2 3 0\n1 2 3\n4 5 6\n");
  EXPECT_EQ(file.shapes.front().points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_THAT(file.warnings,
              ElementsAre("wing.nts: the header has no dim=; the rows of 3 are read as landmarks of one shape"));
}

TEST_F(NtsFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error("t.nts", "\"latitude etc.\n1 1 4 0\n1 2 3 4\n"),
            "t.nts:2: a matrix of 4 columns without dim=, such as covariates; landmarks need dim=2 or dim=3 here");
  EXPECT_EQ(read_error("t.nts", "1 2 4 0 dim=2\n1 2 3 4\n1 2 3\n"),
            "t.nts:3: the file ends where number 4 of 4 of row 2 is expected");
  EXPECT_EQ(read_error("t.nts", "1 1 4 0 dim=2\n1 2 3 4\n5\n"),
            "t.nts:3: there is more than the 1 by 4 numbers that line 1 announces");
  EXPECT_EQ(read_error("t.nts", "1 1 4 0 dim=2\n1 2 3 x\n"),
            "t.nts:2: landmark 2 of specimen 1: y is 'x'; a number is needed");
  EXPECT_EQ(read_error("t.nts", "1 4000000000L 4000000000 0 dim=2\n1 2\n"),
            "t.nts:2: the file ends where the label of row 3 of 4000000000 is expected");
  EXPECT_EQ(read_error("t.nts", "1 4000000000 4000000000 0 dim=2\n1 2\n"),
            "t.nts:2: the file ends where number 3 of 4000000000 of row 1 is expected");
  EXPECT_EQ(read_error("t.nts", "1 1 4 0 dim=3\n1 2 3 4\n"), "t.nts:1: 4 columns cannot be landmarks with dim=3");
  EXPECT_EQ(read_error("t.nts", "1 1 8 0 dim=4\n1 2 3 4\n"), "t.nts:1: dim=4; landmarks have 1, 2 or 3 coordinates");
  EXPECT_EQ(read_error("t.nts", "2 1 8 0 dim=4\n1 2 3 4\n"),
            "t.nts:1: '2 1 8 0 dim=4' where a header such as 1 10 24 0 dim=2 is expected");
}

TEST_F(NtsFile, IsNoTableOfNumbers) {
  EXPECT_EQ(read("t.csv", "\"id\" \"x\" \"y\" \"z\"\n1 15 2 0\n2 16 3 1\n").format, "csv");
}

// ---- morphologika

TEST_F(MorphologikaFile, TakesIndividuals) {
  const LandmarkFile file = read(
      "apes.txt",
      "[Individuals]\r\n2\r\n[landmarks]\r\n2\r\n[Dimensions]\r\n3\r\n[names]\r\nape 1\r\nape 2\r\n[labels]\r\nSex "
      "Age\r\n[labelvalues]\r\nFemale 3\r\nMale 4\r\n[rawpoints]\r\n'#1\r\n1 2 3\r\n4  5\t6\r\n\r\n'#2 \r\n7 8 9\r\n"
      "9999 9999 9999\r\n[wireframe]\r\n1 2\r\n[polygons]\r\n");
  EXPECT_EQ(file.format, "morphologika");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "ape 1");
  EXPECT_EQ(file.shapes[1].name, "ape 2");
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, (Points(3, 2) << 7, kNone, 8, kNone, 9, kNone).finished()));
  EXPECT_THAT(file.shapes[1].properties, ElementsAre(Pair("Sex", "Male"), Pair("Age", "4")));
  EXPECT_THAT(file.warnings, ElementsAre("apes.txt: the section [wireframe] (1 line) is not used"));
}

TEST_F(MorphologikaFile, TakesNamesFromThePoints) {
  const LandmarkFile file = read("m.txt",
                                 "[individuals]\n2\n[landmarks]\n1\n[dimensions]\n2\n[labelvalues]\nold male\nyoung\n"
                                 "[rawpoints]\n'one\n1 2\n'two\nNA NA\n");
  EXPECT_EQ(file.shapes[0].name, "one");
  EXPECT_EQ(file.shapes[1].name, "two");
  EXPECT_THAT(file.shapes[0].properties, ElementsAre(Pair("labelvalues", "old male")));
  EXPECT_THAT(incomplete_points(file.shapes[1].points), ElementsAre(0));
}

TEST_F(MorphologikaFile, RefusesWhatDoesNotFit) {
  const std::string counts = "[individuals]\n2\n[landmarks]\n2\n[dimensions]\n2\n";
  EXPECT_EQ(read_error("m.txt", counts + "[rawpoints]\n'1\n1 2\n3 4\n'2\n1 2\n"),
            "m.txt:7: individual 2 of 2 has 1 landmark; 2 are announced");
  EXPECT_EQ(read_error("m.txt", counts + "[rawpoints]\n'1\n1 2\n'2\n1 2\n3 4\n"),
            "m.txt:10: individual 1 of 2 has 1 landmark; 2 are announced");
  EXPECT_EQ(read_error("m.txt", counts + "[rawpoints]\n1 2\n3 4\n5 6\n7 8\n9 9\n"),
            "m.txt:12: '9 9' after the 2 individuals of 2 landmarks each that are announced");
  EXPECT_EQ(read_error("m.txt", counts + "[rawpoints]\n1 2\n3 4\n5 6\n7 8 9\n"),
            "m.txt:11: landmark 2 of individual 2 has 3 coordinates; 2 are expected");
  EXPECT_EQ(read_error("m.txt", counts + "[names]\nA\n[rawpoints]\n1 2\n3 4\n5 6\n7 8\n"),
            "m.txt:7: [names] has 1 line for 2 individuals");
  EXPECT_EQ(read_error("m.txt", counts), "m.txt:6: there is no section [rawpoints]");
  EXPECT_EQ(read_error("m.txt", counts + "[landmarks]\n3\n"), "m.txt:7: the section [landmarks] is already on line 3");
  EXPECT_EQ(read_error("m.txt", "[individuals]\n4000000000\n[landmarks]\n4000000000\n[dimensions]\n2\n[rawpoints]\n"),
            "m.txt:7: individual 1 of 4000000000 has 0 landmarks; 4000000000 are announced");
  EXPECT_EQ(read_error("m.txt", "[individuals]\nx\n[landmarks]\n1\n[dimensions]\n2\n[rawpoints]\n"),
            "m.txt:2: 'x' where the number of individuals, a whole number from 1, is expected");
  EXPECT_EQ(read_error("m.txt", "[individuals]\n1\n[landmarks]\n1\n[dimensions]\n4\n[rawpoints]\n"),
            "m.txt:5: 4 dimensions; 1, 2 or 3 are expected");
}

// ---- EDMA

TEST_F(EdmaFile, TakesSpecimens) {
  const std::string head = "Children with a syndrome\nXYZ\n2L 2 2\nNAS NSL\n";
  const LandmarkFile file = read("a.xyz", head + "1 2\n3 4\n5 6\n7 NA\n");
  EXPECT_EQ(file.format, "edma");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({5, 6, 7, kNone})));
  EXPECT_THAT(file.shapes[1].labels, ElementsAre("NAS", "NSL"));
  EXPECT_THAT(file.shapes[1].properties, ElementsAre(Pair("title", "Children with a syndrome")));
  EXPECT_THAT(file.warnings, IsEmpty());
  const LandmarkFile named = read("a.xyz", head + "1 2\r\n3 4\r\n5 6\r\n7 8\r\n\r\nS1 scanned on 2\r\nS2\r\n");
  EXPECT_EQ(named.shapes[0].name, "S1 scanned on 2");
  EXPECT_EQ(named.shapes[1].name, "S2");
  const LandmarkFile unnamed = read("a.xyz", "XYZ\n1 3 1\n1 2 3\nS1\nS2\n");
  EXPECT_EQ(unnamed.shapes.front().points, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(unnamed.warnings,
              ElementsAre("a.xyz: 2 lines after the landmarks, which are no names of 1 specimen, are not used"));
}

TEST_F(EdmaFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n2L 2 2\nA B\n1 2\n3 4\n5 6\n"),
            "a.xyz:7: the file ends where landmark 2 of 2 of specimen 2 is expected");
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n2L 2 1\nA B\n1 2\n3 4\n5 6\n"),
            "a.xyz:7: '5 6' after the 1 specimen of 2 landmarks announced");
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n2L 2 1\nA B C\n1 2\n3 4\n"),
            "a.xyz:4: 3 labels where 2 landmarks are announced");
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n4000000000L 2 4000000000\nA B\n"),
            "a.xyz:4: the file ends where label 3 of 4000000000 is expected");
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n2L 5 1\n"),
            "a.xyz:3: '2L 5 1' where the landmarks, dimensions and specimens are expected, such as 10L 2 5");
  EXPECT_EQ(read_error("a.xyz", "t\nXYZ\n1L 2 1\nA\n1 x\n"),
            "a.xyz:5: landmark 1 of specimen 1: y is 'x'; a number is needed");
}

// ---- StereoMorph

constexpr const char* kPixels =
    "\t<landmarks.pixel type=matrix rownames=TRUE colnames=FALSE nrow=2 ncol=2 as.numeric=TRUE >\n"
    "\t\tleft eye\t1\t2\n\t\ttip\tNA\tNA\n\t</landmarks.pixel>\n";
constexpr const char* kScaled =
    "\t<landmarks.scaled type=matrix rownames=TRUE colnames=FALSE nrow=1 ncol=3 as.numeric=TRUE >\n"
    "\t\ttip\t.5\t-2\t3\n\t</landmarks.scaled>\n";

TEST_F(StereomorphFile, PrefersPixels) {
  const LandmarkFile file =
      read("mug.txt", std::string("<shapes type=list>\n\t<scaling.units type=vector length=1 >cm</scaling.units>\n"
                                  "\t<scaling type=vector length=1 >0.5</scaling>\n") +
                          kScaled + kPixels +
                          "\t<curves.pixel type=list>\n\t\t<left side type=matrix rownames=FALSE nrow=2 ncol=2 >\n"
                          "\t\t\t1\t2\n\t\t\t3\t4\n\t\t</left side>\n\t</curves.pixel>\n</shapes>\n");
  EXPECT_EQ(file.format, "stereomorph");
  const Landmarks& shape = file.shapes.front();
  EXPECT_TRUE(have_same_bits(shape.points, points_2d({1, 2, kNone, kNone})));
  EXPECT_THAT(shape.labels, ElementsAre("left eye", "tip"));
  EXPECT_EQ(shape.scale, 0.5);
  EXPECT_THAT(shape.properties, ElementsAre(Pair("scaling.units", "cm")));
  ASSERT_EQ(shape.curves.size(), 1U);
  EXPECT_EQ(shape.curves.front(), points_2d({1, 2, 3, 4}));
  EXPECT_EQ(file.units, "");
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(StereomorphFile, TakesScaledLandmarks) {
  const LandmarkFile file = read("mug.txt", "<shapes type=list>\r\n<scaling.units type=vector >cm</scaling.units>\n" +
                                                std::string(kScaled) + "</shapes>");
  EXPECT_EQ(file.shapes.front().points, Eigen::Vector3d(0.5, -2, 3));
  EXPECT_EQ(file.units, "cm");
  EXPECT_THAT(file.warnings,
              ElementsAre("mug.txt: the landmarks are those of <landmarks.scaled>; there are none in pixels"));
}

TEST_F(StereomorphFile, MayHaveBlanksAndOtherAttributesInTags) {
  const Landmarks shape =
      read_one("mug.txt",
               "<shapes type=list>\n<scaling asnumeric=TRUE >0.5</scaling>\n<scaling.units >mm</scaling.units >\n"
               "<landmarks.pixel  type = matrix  rownames =TRUE nrow= 1 ncol=2 >\nleft eye 1 "
               "2\n</landmarks.pixel>\n</shapes>\n");
  EXPECT_EQ(shape.points, Eigen::Vector2d(1, 2));
  EXPECT_THAT(shape.labels, ElementsAre("left eye"));
  EXPECT_EQ(shape.scale, 0.5);
  EXPECT_THAT(shape.properties, ElementsAre(Pair("scaling.units", "mm")));
}

TEST_F(StereomorphFile, NeedsNoNumberOfColumns) {
  const Landmarks shape =
      read_one("mug.txt", "<landmarks.pixel type=matrix names=TRUE>\ntip 1 2\n</landmarks.pixel>\n");
  EXPECT_EQ(shape.points, Eigen::Vector2d(1, 2));
  EXPECT_THAT(shape.labels, ElementsAre("tip"));
}

TEST_F(StereomorphFile, RefusesWhatDoesNotFit) {
  const std::string pixels = kPixels;
  EXPECT_EQ(read_error("m.txt", "<shapes type=list>\n</shapes>\n"),
            "m.txt:1: there are no landmarks: neither <landmarks.pixel> nor <landmarks.scaled> has rows");
  EXPECT_EQ(read_error("m.txt", "<shapes type=list>\n" + pixels), "m.txt:1: <shapes> has no end in this file");
  EXPECT_EQ(read_error("m.txt", "<shapes>\n" + pixels + "</shape>\n"), "m.txt:6: </shape> where </shapes> is expected");
  EXPECT_EQ(read_error("m.txt",
                       "<shapes>\n<landmarks.pixel type=matrix nrow=4000000000 ncol=2>\n1 2\n"
                       "</landmarks.pixel>\n</shapes>\n"),
            "m.txt:2: <landmarks.pixel> has 1 row, but says nrow=4000000000");
  EXPECT_EQ(
      read_error("m.txt", "<shapes>\n<landmarks.pixel type=matrix ncol=2>\ntip 1 x\n</landmarks.pixel>\n</shapes>"),
      "m.txt:3: landmark 'tip': y is 'x'; a number is needed");
  EXPECT_EQ(
      read_error("m.txt", "<shapes>\n<landmarks.pixel type=matrix ncol=2>\ntip 1 2\n1\n</landmarks.pixel></shapes>"),
      "m.txt:4: landmark 2 has 1 coordinate; 2 are expected");
  EXPECT_THAT(
      read_error("m.txt", "<shapes>\n<landmarks.pixel type=matrix ncol=4>\n1 2 3 4\n</landmarks.pixel>\n</shapes>"),
      HasSubstr("m.txt:2: <landmarks.pixel> has 4 columns; 2 or 3 are expected"));
}

}  // namespace
}  // namespace pulson::formats
