// Points of ImageJ, Fiji, MeshLab, Amira and CMTK, and archives of numpy.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "binary_files.hpp"
#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using RoiFile = ReadingFiles;
using NpzFile = ReadingFiles;
using PointTags = ReadingTexts;
using AmiraFile = ReadingTexts;
using CmtkFile = ReadingTexts;

constexpr int kPolygonRoi = 0, kRectangleRoi = 1, kPolylineRoi = 5, kTracedRoi = 8, kPointRoi = 10;

// ---- ImageJ

TEST_F(RoiFile, HoldsPointsOfOneRegion) {
  const LandmarkFile whole = read("fish.roi", roi_bytes(kPointRoi, {{10, 20}, {30, 5}}, {.name = "0005-0010"}));
  EXPECT_EQ(whole.format, "roi");
  EXPECT_EQ(whole.shapes.at(0).points, points_2d({10, 20, 30, 5}));
  EXPECT_EQ(whole.shapes.at(0).name, "fish");
  EXPECT_TRUE(whole.shapes.at(0).frame.y_down);
  EXPECT_EQ(read_one("b.roi", roi_bytes(kPointRoi, {{10.25, 20.5}, {30, 5}}, {.has_fractions = true})).points,
            points_2d({10.25, 20.5, 30, 5}));
}

TEST_F(RoiFile, HoldsOutlinesAndCurves) {
  const LandmarkFile outline = read("a.roi", roi_bytes(kPolygonRoi, {{1, 2}, {5, 2}, {5, 6}}));
  EXPECT_EQ(outline.shapes.at(0).points, points_2d({1, 2, 5, 2, 5, 6})) << "the only ones are the landmarks";
  EXPECT_THAT(outline.shapes.at(0).groups, ElementsAre("outline 1", "outline 1", "outline 1"));
  const LandmarkFile set = read("RoiSet.zip", zip_bytes({{"1.roi", roi_bytes(kPointRoi, {{1, 2}}, {.name = "tip"})},
                                                         {"fin.roi", roi_bytes(kPointRoi, {{3, 4}})},
                                                         {"3.roi", roi_bytes(kTracedRoi, {{1, 1}, {2, 1}, {2, 2}})},
                                                         {"4.roi", roi_bytes(kPolylineRoi, {{1, 1}, {2, 1}})},
                                                         {"5.roi", roi_bytes(kRectangleRoi, {{1, 1}})},
                                                         {"notes.txt", "about"}}));
  ASSERT_EQ(set.shapes.size(), 1U);
  EXPECT_EQ(set.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(set.shapes[0].labels, ElementsAre("tip", "fin"));
  EXPECT_EQ(set.shapes[0].outlines.size(), 1U);
  EXPECT_EQ(set.shapes[0].curves.size(), 1U);
  EXPECT_THAT(set.warnings, ElementsAre(HasSubstr("are kept"), HasSubstr("1 region not used")));
}

TEST_F(RoiFile, HoldsAShapeForEachSlice) {
  const LandmarkFile single =
      read("a.zip", zip_bytes({{"a.roi", roi_bytes(kPointRoi, {{1, 2}}, {.name = "tip", .position = 1})},
                               {"b.roi", roi_bytes(kPointRoi, {{3, 4}}, {.name = "tip", .position = 2})}},
                              false));
  ASSERT_EQ(single.shapes.size(), 2U);
  EXPECT_EQ(single.shapes[1].name, "slice 2");
  EXPECT_THAT(single.shapes[1].labels, ElementsAre("tip"));
  const LandmarkFile counted =
      read("b.roi", roi_bytes(kPointRoi, {{1, 2}, {3, 4}, {5, 6}, {7, 8}}, {.name = "m", .slices = {3, 3, 4, 4}}));
  ASSERT_EQ(counted.shapes.size(), 2U);
  EXPECT_EQ(counted.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(counted.shapes[1].name, "m slice 4");
  const LandmarkFile sets = read("c.zip", zip_bytes({{"fish1.roi", roi_bytes(kPointRoi, {{1, 2}, {3, 4}})},
                                                     {"fish2.roi", roi_bytes(kPointRoi, {{5, 6}, {7, 8}})}}));
  EXPECT_EQ(sets.shapes.at(1).name, "fish2");
  EXPECT_EQ(sets.shapes.at(1).points, points_2d({5, 6, 7, 8}));
}

TEST_F(RoiFile, RefusesWhatIsBroken) {
  const std::string whole = roi_bytes(kPointRoi, {{1, 2}, {3, 4}});
  EXPECT_EQ(read_error("a.roi", "Iout"),
            "a.roi: it is no region of ImageJ: Iout and 60 bytes more are expected at its beginning");
  EXPECT_THAT(read_error("a.roi", whole.substr(0, 68)),
              HasSubstr("a.roi: it says that it has 2 points; it has 68 bytes"));
  std::string many = whole;
  many.replace(16, 2, "\xFF\xFF");
  EXPECT_THAT(read_error("a.roi", many), HasSubstr("it says that it has 65535 points"));
  EXPECT_THAT(read_error("a.roi", roi_bytes(kRectangleRoi, {{1, 1}})), HasSubstr("there are no points, lines or"));
  std::string wrong = zip_bytes({{"a.roi", whole}});
  wrong[35 + 5] = static_cast<char>(wrong[35 + 5] ^ 1);
  EXPECT_THAT(read_error("a.zip", wrong), HasSubstr("a.zip: 'a.roi' is broken"));
}

// ---- numpy

TEST_F(NpzFile, HoldsArrays) {
  const std::vector<double> numbers = {1, 2, 3, 4};
  const std::string plane = npy_bytes(numbers, {2, 2}), line = npy_bytes(numbers, {4});
  for (const bool is_deflated : {false, true}) {
    const LandmarkFile one = read("a.npz", zip_bytes({{"arr_0.npy", plane}}, is_deflated));
    EXPECT_EQ(one.format, "npz");
    EXPECT_EQ(one.shapes.at(0).points, points_2d({1, 2, 3, 4}));
    EXPECT_EQ(one.shapes.at(0).name, "a");
    EXPECT_THAT(one.warnings, IsEmpty());
  }
  const LandmarkFile named =
      read("b.npz", zip_bytes({{"centroid_size.npy", line}, {"left.npy", plane}, {"right.npy", plane}}));
  ASSERT_EQ(named.shapes.size(), 2U);
  EXPECT_EQ(named.shapes[1].name, "right");
  EXPECT_THAT(named.warnings, ElementsAre("b.npz: the array 'centroid_size' is not read as landmarks"));
  const LandmarkFile chosen = read("c.npz", zip_bytes({{"links.npy", plane}, {"landmarks.npy", plane}}));
  EXPECT_EQ(chosen.shapes.size(), 1U);
  EXPECT_THAT(read_error("d.npz", zip_bytes({{"a.npy", "\x93NUMPY"}})), HasSubstr("d.npz: 'a.npy': the version takes"));
}

// ---- Fiji, MeshLab

TEST_F(PointTags, OfFijiHaveNames) {
  const LandmarkFile file = read(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!DOCTYPE namedpointset [\n  <!ELEMENT namedpointset "
      "(pointworld*)>\n"
      "  <!ATTLIST namedpointset version CDATA #REQUIRED>\n]>\n<namedpointset version=\"1.0\">\n"
      "<pointworld set=\"true\" name=\"the &lt;tip&gt;\" x=\"1.5\" y=\"2\" z=\"3\"/>\n"
      "<pointworld set=\"false\" name=\"fin\"/>\n</namedpointset>\n");
  EXPECT_EQ(file.format, "fiji");
  EXPECT_TRUE(have_same_bits(file.shapes.at(0).points, (Points(3, 2) << 1.5, kNone, 2, kNone, 3, kNone).finished()));
  EXPECT_THAT(file.shapes.at(0).labels, ElementsAre("the <tip>", "fin"));
  EXPECT_EQ(read_error("<namedpointset>\n<pointworld set='true' name='a' x='1' y='2'/></namedpointset>"),
            "t.txt:2: the pointworld 'a' has no z='...'");
  EXPECT_EQ(read_error("<namedpointset>\n</namedpointset>"), "t.txt:2: there is no <pointworld> in this file");
}

TEST_F(PointTags, OfMeshLabMayBeInactive) {
  const LandmarkFile file = read(
      "<!DOCTYPE PickedPoints>\n<PickedPoints>\n <DocumentData><User name=\"me\"/></DocumentData>\n"
      " <point x=\"1\" y=\"2\" z=\"3\" active=\"1\" name=\"0\"/>\n"
      " <point active=\"0\" name=\"1\" x=\"0\" y=\"0\" z=\"0\"/>\n"
      " <point x=\"4\" y=\"5\" z=\"6\" active=\"1\" name=\"2\"/></PickedPoints>\n");
  EXPECT_EQ(file.format, "meshlab");
  EXPECT_TRUE(
      have_same_bits(file.shapes.at(0).points, (Points(3, 3) << 1, kNone, 4, 2, kNone, 5, 3, kNone, 6).finished()));
  EXPECT_THAT(file.shapes.at(0).labels, ElementsAre("0", "1", "2"));
  EXPECT_EQ(read_error("<PickedPoints>\n<point name='a' x='1' y='b' z='3'/></PickedPoints>"),
            "t.txt:2: landmark 'a': y is 'b'; a number is needed");
}

// ---- Amira

const std::string kAmiraHead =
    "# AmiraMesh 3D ASCII 2.0\n\n\ndefine Markers 2\n\nParameters {\n    NumSets 2,\n    ContentType "
    "\"LandmarkSet\"\n}\n\n"
    "Markers { float[3] Coordinates } @1\nMarkers { float[3] Coordinates2 } = @2\nMarkers { int Types } @3\n\n"
    "# Data section follows\n";

TEST_F(AmiraFile, HasAShapeForEachSet) {
  const LandmarkFile file = read(kAmiraHead + "@1\n1.5e+00 2 3 \n4 5 6 \n\n@3\n1\n1\n@2\n7 8 9\n10 11 12\n");
  EXPECT_EQ(file.format, "amira");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 1.5, 4, 2, 5, 3, 6).finished());
  EXPECT_EQ(file.shapes[1].points.col(1), Eigen::Vector3d(10, 11, 12));
}

TEST_F(AmiraFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error(kAmiraHead + "@1\n1 2 3\n4 5 6\n7 8 9\n"), "t.txt:19: '7 8 9' after the 2 landmarks announced");
  EXPECT_EQ(read_error(kAmiraHead + "@1\n1 2 3\n4 5 6\n"), "t.txt: the section '@2' is not there");
  EXPECT_EQ(read_error(kAmiraHead + "@1\n1 2 3\n4 5\n"), "t.txt:18: landmark 2 has 2 coordinates; 3 are expected");
  EXPECT_EQ(read_error(kAmiraHead + "@1\n1 2 3\n"), "t.txt:17: the file ends where landmark 2 of 2 is expected");
  EXPECT_EQ(read_error("# AmiraMesh BINARY-LITTLE-ENDIAN 2.1\ndefine Markers 2\n"),
            "t.txt:1: numbers of Amira as bytes, which are not read; save the landmarks as .landmarkAscii");
  EXPECT_THAT(read_error("# AmiraMesh 3D ASCII 2.0\ndefine Markers 2\n"), HasSubstr("the header has no"));
}

// ---- CMTK

TEST_F(CmtkFile, HasNamesAfterThePoints) {
  const LandmarkFile file = read("# of the left brain\n157.3 88.2 95 Left Eye\n1e2 -88 9.5 tip\n");
  EXPECT_EQ(file.format, "cmtk");
  EXPECT_EQ(file.shapes.at(0).points, (Points(3, 2) << 157.3, 100, 88.2, -88, 95, 9.5).finished());
  EXPECT_THAT(file.shapes.at(0).labels, ElementsAre("Left Eye", "tip"));
  write("a.txt", "1 2 3 a\n4 b 6 c\n");
  EXPECT_EQ(error_of([] { read_landmark_file("a.txt", {.format = "cmtk"}); }),
            "a.txt:2: landmark 'c': y is 'b'; a number is needed");
  write("b.txt", "1 2 3 a\n4 5 6\n");
  EXPECT_EQ(error_of([] { read_landmark_file("b.txt", {.format = "cmtk"}); }),
            "b.txt:2: '4 5 6' where x y z name is expected");
}

}  // namespace
}  // namespace pulson::formats
