// Point lists and markups of 3D Slicer: what is read, what is written, what is refused.

#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

using Fcsv = ReadingTexts;
using Markups = ReadingTexts;

const std::string kMagic = "# Markups fiducial file version = 4.11\n";
const std::string kRow = "1,1.5,-2,3,0,0,0,1,1,1,0,tip,AC,\n";

// ---- fcsv

TEST_F(Fcsv, IsReadWithItsAxesAndLabels) {
  const LandmarkFile file = read(kMagic + "# CoordinateSystem = LPS\n" +
                                 "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n" + kRow +
                                 "2,4,5,6,0,0,0,1,1,1,0,\"fin, \"\"left\"\"\",,\n");
  EXPECT_EQ(file.format, "fcsv");
  EXPECT_EQ(file.axes, "LPS");
  EXPECT_EQ(file.units, "mm");
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 1.5, 4, -2, 5, 3, 6).finished());
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip", "fin, \"left\""));
  EXPECT_EQ(file.shapes[0].name, "t");
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST_F(Fcsv, KnowsNumbersOfAxesAndTheirWords) {
  const auto axes = [](const std::string& value) {
    return read(kMagic + "# CoordinateSystem = " + value + "\n" + kRow).axes;
  };
  EXPECT_EQ(axes("0"), "RAS");
  EXPECT_EQ(axes("RAS"), "RAS");
  EXPECT_EQ(axes("1"), "LPS");
  EXPECT_EQ(axes("lps"), "LPS");
  EXPECT_EQ(read(kMagic + kRow).axes, "") << "RAS to Slicer 4.10, LPS from 4.11 on";
  EXPECT_EQ(read(kMagic + kRow).units, "mm");
  const LandmarkFile voxels = read(kMagic + "# CoordinateSystem = 2\n" + kRow);
  EXPECT_EQ(voxels.axes, "");
  EXPECT_EQ(voxels.units, "voxels");
  EXPECT_THAT(voxels.warnings, ElementsAre(HasSubstr("indices (IJK)")));
  EXPECT_EQ(read_error(kMagic + "# CoordinateSystem = 7\n" + kRow),
            "t.txt:2: CoordinateSystem is '7'; RAS, LPS, IJK or 0, 1, 2 is expected");
}

TEST_F(Fcsv, TakesColumnsInAnyOrder) {
  const Landmarks shape =
      read("# Fiducial List file a.fcsv\r\n# columns = label,z,y,x\r\ntip,3,2,1\r\n\r\nfin,6,nan,4").shapes[0];
  EXPECT_EQ(shape.points.col(0), Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(incomplete_points(shape.points), ElementsAre(1));
  EXPECT_THAT(shape.labels, ElementsAre("tip", "fin"));
  EXPECT_THAT(read(kMagic + "# columns = x,y,z\n1,2,3\n").shapes[0].labels, IsEmpty());
  EXPECT_EQ(read(kMagic).shapes[0].count(), 0);
  EXPECT_THAT(read(kMagic + "# columns = id,x,y,z,Name,Description\n1,2,3,4,tip,left\n").shapes[0].labels,
              ElementsAre("tip"));
  EXPECT_THAT(read(kMagic + "# columns = name,x,y,z,label\n1,2,3,4,tip\n").shapes[0].labels, ElementsAre("tip"));
}

TEST_F(Fcsv, OfSlicer3IsInRasAndBeginsWithLabels) {
  const std::string magic = "# Fiducial List file a.fcsv\n";
  for (const std::string columns :
       {"", "# numPoints = 1\n# label,x,y,z,sel,vis\n", "# columns = label,x,y,z,sel,vis\n"}) {
    const LandmarkFile file = read(magic + columns + "LE, -30.5, 64, 13, 1, 1\n");
    EXPECT_EQ(file.shapes[0].points, Eigen::Vector3d(-30.5, 64, 13));
    EXPECT_THAT(file.shapes[0].labels, ElementsAre("LE"));
    EXPECT_EQ(file.axes, "RAS");
    EXPECT_EQ(file.units, "mm");
  }
  EXPECT_EQ(read(magic + "# CoordinateSystem = LPS\nLE,1,2,3,1,1\n").axes, "LPS");
  const LandmarkFile of_slicer_4 = read(magic + kRow);
  EXPECT_EQ(of_slicer_4.shapes[0].points, Eigen::Vector3d(1.5, -2, 3));
  EXPECT_THAT(of_slicer_4.shapes[0].labels, ElementsAre("tip"));
}

TEST_F(Fcsv, MayHaveBeenSavedByASpreadsheet) {
  const LandmarkFile file = read(
      "# Markups fiducial file version = 4.11,,,,\n# CoordinateSystem = LPS , ,,,\n# columns = id,x,y,z,label,,\n"
      "1,2,3,4,tip,,\n");
  EXPECT_EQ(file.axes, "LPS");
  EXPECT_EQ(file.shapes[0].points, Eigen::Vector3d(2, 3, 4));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip"));
  EXPECT_EQ(read("# CoordinateSystem = 0,\n#,,,\n#\n" + kRow).axes, "RAS");
}

TEST_F(Fcsv, IsRefusedByLine) {
  EXPECT_EQ(read_error(kMagic + "# columns = id,x,y\n"), "t.txt:2: no column 'z' in 'id,x,y'");
  EXPECT_EQ(read_error(kMagic + "1,2,3\n"), "t.txt:2: landmark 1 has 3 columns; 4 are needed");
  EXPECT_EQ(read_error(kMagic + kRow + "1,2,abc,3\n"), "t.txt:3: landmark 2: y is 'abc'; a number is needed");
  EXPECT_EQ(read_error(kMagic + "1,2,inf,3\n"), "t.txt:2: landmark 1: y is 'inf'; a coordinate must be finite");
  EXPECT_EQ(read_error(kMagic + "1,2,3,4,\"tip\n"), "t.txt:2: a quotation mark is not closed");
}

TEST_F(Fcsv, IsWrittenToTheBits) {
  LandmarkFile file = one_shape(hard_points(3, 40));
  file.axes = "RAS";
  file.units = "mm";
  for (int i = 0; i < 40; ++i) file.shapes[0].labels.push_back("tip \"" + std::to_string(i) + "\", #left");
  EXPECT_THAT(write_landmark_file("t.fcsv", file), IsEmpty());
  EXPECT_THAT(contents("t.fcsv"), StartsWith("# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"));
  const LandmarkFile back = read_landmark_file("t.fcsv");
  EXPECT_TRUE(have_same_bits(back.shapes[0].points, file.shapes[0].points));
  EXPECT_EQ(back.shapes[0].labels, file.shapes[0].labels);
  EXPECT_EQ(back.axes, "RAS");
}

TEST_F(Fcsv, TellsWhatItCannotHold) {
  LandmarkFile file = one_shape(points_2d({1, 2, 3, 4}));
  file.shapes[0].groups = {"a", "b"};
  file.units = "inch";
  EXPECT_THAT(write_landmark_file("t.fcsv", file),
              ElementsAre("t.fcsv: fcsv cannot hold groups",
                          "t.fcsv: fcsv cannot hold the units 'inch'; the numbers will be read as mm",
                          "t.fcsv: landmarks in the plane get z = 0"));
  EXPECT_EQ(read_landmark_file("t.fcsv").axes, "LPS");
  EXPECT_EQ(read_landmarks("t.fcsv").points, (Points(3, 2) << 1, 3, 2, 4, 0, 0).finished());
  file.shapes[0].labels = {"a\nb", " c "};
  EXPECT_THAT(write_landmark_file("t.fcsv", file),
              testing::Contains("t.fcsv: fcsv cannot hold line breaks and outer blanks of texts"));
  EXPECT_THAT(read_landmarks("t.fcsv").labels, ElementsAre("a b", "c"));
  EXPECT_THAT(write_error("t.fcsv", one_shape(points_2d({1, std::nan("")}))),
              HasSubstr("fcsv cannot hold missing coordinates; landmark 1 of the shape misses one"));
  EXPECT_THAT(write_error("t.fcsv", one_shape(Points::Ones(1, 2))), HasSubstr("is in 1D"));
  file.shapes.resize(5);
  EXPECT_EQ(write_error("t.fcsv", file), "t.fcsv: fcsv holds one shape; there are 5");
}

TEST_F(Fcsv, TellsThatVoxelsAreWrittenAsMillimetres) {
  for (const std::string& text : {kMagic + "# CoordinateSystem = IJK\n" + kRow, std::string("index\n1\n1 2 3\n")}) {
    const LandmarkFile voxels = read(text);
    for (const std::string format : {"fcsv", "mrk.json"})
      EXPECT_THAT(write_landmark_file("t." + format, voxels),
                  testing::Contains("t." + format + ": " + format +
                                    " cannot hold the units 'voxels'; the numbers will be read as mm"));
  }
}

// ---- markups

std::string markup(const std::string& keys, const std::string& points) {
  return "{" + keys + (keys.empty() ? "" : ", ") + "\"controlPoints\": [" + points + "]}";
}

std::string markups(const std::string& list) { return "\n{\"@schema\": \"x\", \"markups\" : [" + list + "]}"; }

const std::string kPoint = R"({"label": "tip", "position": [1.5, -2, 3], "positionStatus": "defined"})";

TEST_F(Markups, AreReadAsShapes) {
  const LandmarkFile file = read(markups(
      markup(R"("type": "Fiducial", "coordinateSystem": "RAS", "coordinateUnits": "um")",
             kPoint + R"(, {"label": "fin", "positionStatus": "undefined"},
                         {"position": [0, 0, 0], "positionStatus": "missing"})") +
      ", " +
      markup(
          R"("type": "ClosedCurve", "name": "rim", "coordinateSystem": "RAS", "coordinateUnits": ["um", "UCUM", ""])",
          "")));
  EXPECT_EQ(file.format, "mrk.json");
  EXPECT_EQ(file.axes, "RAS");
  EXPECT_EQ(file.units, "um");
  EXPECT_THAT(file.warnings, IsEmpty());
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].points.col(0), Eigen::Vector3d(1.5, -2, 3));
  EXPECT_THAT(incomplete_points(file.shapes[0].points), ElementsAre(1, 2));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip", "fin", ""));
  EXPECT_EQ(file.shapes[0].name, "t#1");
  EXPECT_EQ(file.shapes[1].name, "rim");
  EXPECT_EQ(file.shapes[1].count(), 0);
  EXPECT_THAT(file.shapes[1].properties, ElementsAre(testing::Pair("type", "ClosedCurve")));
}

TEST_F(Markups, HaveTheSchemasDefaults) {
  const LandmarkFile file = read(markups(markup("", R"({"position": [1, 2, 3]})")));
  EXPECT_EQ(file.axes, "LPS");
  EXPECT_EQ(file.units, "mm");
  EXPECT_THAT(file.shapes[0].labels, IsEmpty());
  EXPECT_EQ(file.shapes[0].count(), 1);
  EXPECT_THAT(read(markups(markup(R"("type": "Plane")", kPoint))).warnings,
              ElementsAre("t.txt: of markup 1, a Plane, only the control points are read"));
  EXPECT_THAT(read(markups(markup(R"("type": "ROI")", kPoint))).warnings,
              ElementsAre("t.txt: of markup 1, an ROI, only the control points are read"));
}

TEST_F(Markups, MissLandmarksThatHaveNoPlace) {
  const auto missing = [](const std::string& keys) {
    const Points points = read(markups(markup("", "{" + keys + "}"))).shapes[0].points;
    return points.array().isNaN().count();
  };
  for (const std::string keys :
       {"", R"("label": "tip")", R"("position": null)", R"("position": "")",
        R"("position": "", "positionStatus": "preview")", R"("positionStatus": "preview")",
        R"("position": ["NA", "NA", "NA"], "positionStatus": "defined")", R"("position": [NaN, NaN, NaN])",
        R"("position": [1, 2, 3], "positionStatus": "undefined")",
        R"("position": [1, 2, 3], "positionStatus": "missing")"})
    EXPECT_EQ(missing(keys), 3) << keys;
  EXPECT_EQ(missing(R"("position": [1, "NA", null])"), 2);
  EXPECT_EQ(missing(R"("position": [1, 2, 3], "positionStatus": "preview")"), 0);
  EXPECT_EQ(missing(R"("position": [1, 2, 3])"), 0);
}

TEST_F(Markups, MayHaveNumbersForLabels) {
  EXPECT_THAT(read(markups(markup("", R"({"label": 7, "position": [1, 2, 3]}, {"label": 0.5})"))).shapes[0].labels,
              ElementsAre("7", "0.5"));
}

TEST_F(Markups, AreRefusedByPlace) {
  EXPECT_EQ(read_error(markups("")), "t.txt: 'markups' is empty; a markup is needed");
  EXPECT_EQ(read_error(markups("7")), "t.txt: 'markups[0]' is not an object");
  EXPECT_EQ(read_error(markups(markup("", "7"))), "t.txt: 'markups[0].controlPoints[0]' is not an object");
  EXPECT_EQ(read_error(markups(markup("", R"({"positionStatus": "defined"})"))),
            "t.txt: 'markups[0].controlPoints[0].position' is missing");
  for (const std::string position : {"7", R"("tip")", "{}", R"(["x", 1, 2])", "[[1], 2, 3]"})
    EXPECT_EQ(read_error(markups(markup("", "{\"position\": " + position + "}"))),
              "t.txt: 'markups[0].controlPoints[0].position' is not a list of 3 numbers");
  EXPECT_EQ(read_error(markups(markup("", R"({"label": []})"))),
            "t.txt: 'markups[0].controlPoints[0].label' is not a string");
  EXPECT_EQ(read_error(markups(markup("", R"({"position": [1, 2]})"))),
            "t.txt: 'markups[0].controlPoints[0].position' is not a list of 3 numbers");
  EXPECT_EQ(read_error(markups(markup("\"coordinateSystem\": \"XYZ\"", ""))),
            "t.txt: 'markups[0].coordinateSystem' is 'XYZ'; LPS or RAS is expected");
  EXPECT_EQ(read_error(markups(markup("", "") + "," + markup("\"coordinateUnits\": \"um\"", ""))),
            "t.txt: 'markups[1]' has the units 'um', the first has 'mm'; one for all is needed");
  EXPECT_THAT(read_error(markups(kPoint) + "]"), StartsWith("t.txt:2: column "));
}

TEST_F(Markups, AreWrittenToTheBits) {
  LandmarkFile file = one_shape(hard_points(3, 40));
  file.axes = "RAS";
  file.units = "um";
  for (int i = 0; i < 40; ++i) file.shapes[0].labels.push_back("\"tip\"\n" + std::to_string(i));
  file.shapes.push_back(one_shape(hard_points(3, 10)).shapes[0]);
  file.shapes[0].name = "skull";
  file.shapes[1].name = "rim";
  file.shapes[1].properties = {{"type", "ClosedCurve"}};
  file.shapes[1].points.col(3).setConstant(std::nan(""));
  EXPECT_THAT(write_landmark_file("t.mrk.json", file), IsEmpty());
  const LandmarkFile back = read_landmark_file("t.mrk.json");
  EXPECT_EQ(back.format, "mrk.json");
  EXPECT_EQ(back.axes, "RAS");
  EXPECT_EQ(back.units, "um");
  ASSERT_EQ(back.shapes.size(), 2U);
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_TRUE(have_same_bits(back.shapes[s].points, file.shapes[s].points));
    EXPECT_EQ(back.shapes[s].labels, file.shapes[s].labels);
    EXPECT_EQ(back.shapes[s].name, file.shapes[s].name);
    EXPECT_EQ(back.shapes[s].properties, file.shapes[s].properties);
  }
}

TEST_F(Markups, TellOfAllButTheirOneType) {
  LandmarkFile file;
  file.shapes.emplace_back().points = Points::Zero(3, 1);
  const auto losses = [&](std::vector<std::pair<std::string, std::string>> properties) {
    file.shapes[0].properties = std::move(properties);
    return write_landmark_file("t.mrk.json", file);
  };
  EXPECT_THAT(losses({{"type", "Line"}}), IsEmpty());
  const auto reported = ElementsAre("t.mrk.json: mrk.json cannot hold properties");
  EXPECT_THAT(losses({{"type", "Line"}, {"type", "Line"}}), reported);
  EXPECT_THAT(losses({{"type", "Line"}, {"type", "Angle"}}), reported);
  EXPECT_THAT(losses({{"type", "Fiducial"}}), reported);  // where nothing is read
}

TEST_F(Markups, HaveWhatTheSchemaAsksFor) {
  LandmarkFile file = one_shape(points_2d({1, 2, 3, std::nan("")}));
  file.shapes[0].groups = {"a", "b"};
  EXPECT_THAT(write_landmark_file("t.mrk.json", file),
              ElementsAre("t.mrk.json: mrk.json cannot hold groups", "t.mrk.json: landmarks in the plane get z = 0",
                          "t.mrk.json: landmarks that have a missing coordinate are written without any"));
  const std::string text = contents("t.mrk.json");
  for (const std::string part :
       {"\"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/", "markups-schema-v1.0.3.json#\"",
        "\"type\":\"Fiducial\"", "\"coordinateSystem\":\"LPS\"", "\"coordinateUnits\":\"mm\"", "\"id\":\"1\"",
        "\"position\":[1.0,2.0,0.0]", "\"positionStatus\":\"defined\"", "\"positionStatus\":\"missing\"",
        "\"orientation\":[-1.0,0.0,0.0,0.0,-1.0,0.0,0.0,0.0,1.0]"})
    EXPECT_THAT(text, HasSubstr(part));
  EXPECT_THAT(write_error("t.mrk.json", one_shape(Points::Ones(1, 2))), HasSubstr("is in 1D"));
  EXPECT_THAT(write_error("t.mrk.json", {}), HasSubstr("no shapes"));
}

}  // namespace
}  // namespace pulson::formats
