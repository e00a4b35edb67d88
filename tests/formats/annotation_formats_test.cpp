// Landmarks of programs that annotate pictures: COCO, OpenPose, VIA, QuPath, CVAT, and points by name in JSON.

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

using CocoFile = ReadingTexts;
using OpenPoseFile = ReadingTexts;
using ViaFile = ReadingTexts;
using GeoJsonFile = ReadingTexts;
using CvatFile = ReadingTexts;
using PointsByName = ReadingTexts;

// ---- COCO

const std::string kCocoHead =
    R"({"info": {}, "images": [{"id": 7, "file_name": "val/a.jpg", "width": 64, "height": 48}, {"id": "b", "file_name": "b.png"}],
"categories": [{"id": 1, "name": "fish", "keypoints": ["nose", "fin", "tail"], "skeleton": [[1, 3], [3, 2]]}],
"annotations": [)";

TEST_F(CocoFile, HasAShapeForEachAnnotation) {
  const LandmarkFile file = read(kCocoHead + R"(
{"image_id": 7, "category_id": 1, "keypoints": [1, 2, 2, 3.5, 4, 1, 0, 0, 0], "bbox": [0, 0, 9, 9]},
{"image_id": "b", "category_id": 1, "keypoints": [9, 8, 0, 5, 6, 2, 7, 8, 2]},
{"image_id": 7, "category_id": 1, "keypoints": [5, 5, 2, 6, 6, 2, 7, 7, 2]},
{"image_id": 7, "category_id": 1, "bbox": [1, 2, 3, 4]}]})");
  EXPECT_EQ(file.format, "coco");
  ASSERT_EQ(file.shapes.size(), 3U);
  const Landmarks& first = file.shapes[0];
  EXPECT_TRUE(have_same_bits(first.points, points_2d({1, 2, 3.5, 4, kNone, kNone})));
  EXPECT_THAT(first.labels, ElementsAre("nose", "fin", "tail"));
  EXPECT_THAT(first.links, ElementsAre(Pair(0, 2), Pair(2, 1)));
  EXPECT_EQ(first.image, "val/a.jpg");
  EXPECT_EQ(first.frame.width, 64);
  EXPECT_EQ(first.frame.height, 48);
  EXPECT_TRUE(first.frame.y_down);
  EXPECT_EQ(first.frame.orientation, Orientation::kDisplayed);
  EXPECT_EQ(first.name, "a_1");
  EXPECT_EQ(file.shapes[1].name, "b");
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({kNone, kNone, 5, 6, 7, 8})));
  EXPECT_EQ(file.shapes[2].name, "a_2");
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: 1 annotation without keypoints left out",
                                         HasSubstr("1 keypoint with a position and visibility 0")));
}

TEST_F(CocoFile, MayBeAListOfResults) {
  const LandmarkFile file = read(R"([{"image_id": 3, "category_id": 1, "keypoints": [1, 2, 0, 3, 4, 0], "score": 0.5},
{"image_id": 4, "category_id": 1, "keypoints": [5, 6, 0.9, 0, 0, 0], "score": 0.5}])");
  EXPECT_EQ(file.format, "coco");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "3");
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({5, 6, kNone, kNone})));
}

TEST_F(CocoFile, RefusesWhatDoesNotFit) {
  EXPECT_EQ(read_error(kCocoHead + "]}"), "t.txt: 'annotations' has no annotation with keypoints");
  EXPECT_EQ(read_error(kCocoHead + R"({"image_id": 7, "keypoints": [1, 2, 2, 3]}]})"),
            "t.txt: 'annotations[0].keypoints' has 4 numbers; three of each keypoint, x, y and visibility, are needed");
  EXPECT_EQ(read_error(kCocoHead + R"({"image_id": 7, "category_id": 1, "keypoints": [1, 2, 2]}]})"),
            "t.txt: 'annotations[0].keypoints' has 1 keypoint; its category names 3");
  EXPECT_EQ(read_error(R"({"categories": [{"id": 1, "keypoints": ["a"], "skeleton": [[1, 2]]}], "annotations": []})"),
            "t.txt: 'categories[0].skeleton[0]' joins landmarks that are not there; they are 1 to 1");
}

// ---- OpenPose

TEST_F(OpenPoseFile, HasAShapeForEachPerson) {
  const LandmarkFile file = read(
      R"({"version": 1.3, "people": [{"person_id": [-1], "pose_keypoints_2d": [1, 2, 0.9, 0, 0, 0], "face_keypoints_2d": []},
{"pose_keypoints_2d": [3, 4, 0.5, 5, 6, 0.1]}]})");
  EXPECT_EQ(file.format, "openpose");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_TRUE(have_same_bits(file.shapes[0].points, points_2d({1, 2, kNone, kNone})));
  EXPECT_EQ(file.shapes[1].points, points_2d({3, 4, 5, 6}));
  EXPECT_THAT(file.shapes[0].groups, IsEmpty());
  EXPECT_EQ(file.shapes[0].name, "t#1");
}

TEST_F(OpenPoseFile, GroupsPartsAndMayBeInSpace) {
  const LandmarkFile file = read(
      R"({"people": [{"pose_keypoints_2d": [1, 2, 1], "hand_left_keypoints_2d": [3, 4, 1]},
{"pose_keypoints_2d": [], "pose_keypoints_3d": [1, 2, 3, 1]}]})");
  EXPECT_THAT(file.shapes[0].groups, ElementsAre("pose", "left hand"));
  EXPECT_EQ(file.shapes[1].points, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(
      read_error(R"({"people": [{"pose_keypoints_2d": [1, 2]}]})"),
      "t.txt: 'people[0].pose_keypoints_2d' has 2 numbers; 3 of each keypoint, its place and confidence, are needed");
}

// ---- VIA

TEST_F(ViaFile, HasAShapeForEachImage) {
  const std::string region =
      R"({"shape_attributes": {"name": "point", "cx": 1, "cy": 2.5}, "region_attributes": {"lm": "tip", "sure": "yes"}})";
  const std::string images =
      R"({"a.jpg99": {"filename": "a.jpg", "size": 99, "regions": [)" + region +
      R"(, {"shape_attributes": {"name": "polygon", "all_points_x": [0, 1, 1, 0], "all_points_y": [0, 0, 1, 0]}},
{"shape_attributes": {"name": "rect", "x": 1}}]}, "b.jpg1": {"filename": "b.jpg", "regions": {"1": {"shape_attributes":
{"name": "point", "cx": 3, "cy": 4}, "region_attributes": {"lm": 2}}, "0": )" +
      region + "}}}";
  for (const std::string& text : {images, R"({"_via_settings": {}, "_via_img_metadata": )" + images + "}"}) {
    const LandmarkFile file = read(text);
    EXPECT_EQ(file.format, "via");
    ASSERT_EQ(file.shapes.size(), 2U);
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2.5}));
    EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip"));
    EXPECT_EQ(file.shapes[0].outlines.at(0), points_2d({0, 0, 1, 0, 1, 1}));
    EXPECT_EQ(file.shapes[0].name, "a");
    EXPECT_EQ(file.shapes[0].frame.orientation, Orientation::kDisplayed);
    EXPECT_EQ(file.shapes[1].points, points_2d({1, 2.5, 3, 4}));
    EXPECT_THAT(file.shapes[1].labels, ElementsAre("tip", "2"));
    EXPECT_THAT(file.warnings,
                ElementsAre(HasSubstr("1 outline (3 points) are kept"), HasSubstr("1 region 'rect' not used")));
  }
}

TEST_F(ViaFile, MayBeATable) {
  const std::string rows =
      "filename,file_size,file_attributes,region_count,region_id,region_shape_attributes,region_attributes\n"
      "a.jpg,1,\"{}\",2,0,\"{\"\"name\"\":\"\"point\"\",\"\"cx\"\":1,\"\"cy\"\":2}\",\"{\"\"Name\"\":\"\"tip\"\"}\"\n"
      "b.jpg,1,\"{}\",1,0,\"{\"\"name\"\":\"\"point\"\",\"\"cx\"\":5,\"\"cy\"\":6}\",\"{}\"\n"
      "a.jpg,1,\"{}\",2,1,\"{\"\"name\"\":\"\"point\"\",\"\"cx\"\":3,\"\"cy\"\":4}\",\"{\"\"Name\"\":\"\"fin\"\"}\"\n"
      "c.jpg,1,\"{}\",0,0,\"{}\",\"{}\"\n";
  for (const std::string mark : {"", "#"}) {
    const LandmarkFile file = read(mark + rows);
    EXPECT_EQ(file.format, "via.csv");
    ASSERT_EQ(file.shapes.size(), 2U);
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4}));
    EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip", "fin"));
    EXPECT_EQ(file.shapes[1].image, "b.jpg");
  }
  EXPECT_THAT(read_error(rows + "d.jpg,1,\"{}\",1,0,\"{\"\"name\"\":\"\"point\"\",\"\"cx\"\":1}\",\"{}\"\n"),
              HasSubstr("t.txt:6: 'cy' is missing"));
}

TEST_F(ViaFile, KnowsLandmarksByNumberWhereLabelsRepeat) {
  const std::string point =
      R"({"shape_attributes": {"name": "point", "cx": 1, "cy": 2}, "region_attributes": {"a": "fish"}})";
  const LandmarkFile file = read(R"({"a": {"filename": "a.jpg", "regions": [)" + point + ", " + point + "]}}");
  EXPECT_THAT(file.shapes[0].labels, IsEmpty());
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("the label 'fish' repeats within a shape")));
}

// ---- GeoJSON

std::string feature(const std::string& kind, const std::string& coordinates, const std::string& properties) {
  return R"({"type": "Feature", "geometry": {"type": ")" + kind + R"(", "coordinates": )" + coordinates +
         R"(}, "properties": )" + properties + "}";
}

TEST_F(GeoJsonFile, HasPointsLinesAndPolygons) {
  const std::string features =
      feature("Point", "[1, 2]", R"({"objectType": "annotation", "name": "tip"})") + ", " +
      feature("Point", "[3, 4, 9]", R"({"objectType": "annotation", "classification": {"name": "fin"}})") + ", " +
      feature("LineString", "[[0, 0], [5, 5]]", "{}") + ", " +
      feature("Polygon", "[[[0, 0], [4, 0], [4, 4], [0, 0]], [[1, 1], [2, 1], [2, 2], [1, 1]]]", "null") + ", " +
      R"({"type": "Feature", "geometry": null, "properties": {}})";
  for (const std::string& text :
       {R"({"type": "FeatureCollection", "features": [)" + features + "]}", "[" + features + "]"}) {
    const LandmarkFile file = read(text);
    EXPECT_EQ(file.format, "geojson");
    const Landmarks& shape = file.shapes.at(0);
    EXPECT_EQ(shape.points, points_2d({1, 2, 3, 4}));
    EXPECT_THAT(shape.labels, ElementsAre("tip", "fin"));
    EXPECT_EQ(shape.curves.size(), 1U);
    ASSERT_EQ(shape.outlines.size(), 2U);
    EXPECT_EQ(shape.outlines[1], points_2d({1, 1, 2, 1, 2, 2}));
    EXPECT_TRUE(shape.frame.y_down && shape.frame.says_y);
  }
}

TEST_F(GeoJsonFile, GroupsSeveralSetsOfPoints) {
  const LandmarkFile one = read(feature("MultiPoint", "[[1, 2], [3, 4]]", R"({"name": "landmarks"})"));
  EXPECT_EQ(one.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(one.shapes[0].groups, IsEmpty());
  const LandmarkFile two = read("[" + feature("MultiPoint", "[[1, 2]]", R"({"name": "left"})") + "," +
                                feature("MultiPoint", "[[3, 4]]", "{}") + "]");
  EXPECT_THAT(two.shapes[0].groups, ElementsAre("left", "points 1"));
  EXPECT_THAT(read_error(feature("Point", "[1]", "{}")), HasSubstr("is not a point [x, y]"));
  EXPECT_THAT(read_error(R"({"type": "FeatureCollection", "features": [{"geometry": null, "properties": {}}]})"),
              HasSubstr("has no points, lines or polygons"));
}

// ---- CVAT

const std::string kCvatHead = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n<version>1.1</version>\n";

TEST_F(CvatFile, HasPointsAndSkeletonsOfImages) {
  const LandmarkFile file = read(kCvatHead +
                                 "<image id=\"0\" name=\"x/a.jpg\" width=\"64\" height=\"48\">\n"
                                 "<points label=\"eye\" points=\"1.5,2\" occluded=\"1\"/>\n"
                                 "<points label=\"fin\" points=\"3,4;5,6\"></points>\n<box label=\"b\" xtl=\"0\"/>\n"
                                 "<polygon label=\"o\" points=\"0,0;1,0;1,1\"/>\n</image>\n"
                                 "<image id=\"1\" name=\"b.jpg\">\n<skeleton label=\"fish\">\n"
                                 "<points label=\"1\" outside=\"0\" points=\"1,2\"/>\n"
                                 "<points label=\"2\" outside=\"1\" points=\"0,0\"/></skeleton>\n"
                                 "<skeleton label=\"fish\"><points label=\"1\" points=\"7,8\"/>"
                                 "<points label=\"2\" points=\"9,9\"/></skeleton></image></annotations>\n");
  EXPECT_EQ(file.format, "cvat");
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[0].points, points_2d({1.5, 2, 3, 4, 5, 6}));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("eye", "fin_1", "fin_2"));
  EXPECT_EQ(file.shapes[0].name, "a");
  EXPECT_EQ(file.shapes[0].frame.height, 48);
  EXPECT_EQ(file.shapes[0].outlines.size(), 1U);
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({1, 2, kNone, kNone})));
  EXPECT_EQ(file.shapes[1].name, "b_1");
  EXPECT_EQ(file.shapes[2].points, points_2d({7, 8, 9, 9}));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("outline"), "t.txt: 1 <box> not used"));
}

TEST_F(CvatFile, HasAShapeForEachFrameOfAVideo) {
  const LandmarkFile file = read(kCvatHead +
                                 "<track id=\"0\" label=\"eye\"><points frame=\"0\" outside=\"0\" points=\"1,2\"/>\n"
                                 "<points frame=\"5\" outside=\"0\" points=\"3,4\"/></track>\n"
                                 "<track id=\"1\" label=\"fin\"><points frame=\"0\" outside=\"0\" points=\"5,6\"/>\n"
                                 "<points frame=\"5\" outside=\"1\" points=\"5,6\"/></track></annotations>");
  ASSERT_EQ(file.shapes.size(), 2U);
  EXPECT_EQ(file.shapes[0].name, "0");
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 5, 6}));
  EXPECT_EQ(file.shapes[1].name, "5");
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({3, 4, kNone, kNone})));
  EXPECT_THAT(file.shapes[1].labels, ElementsAre("eye", "fin"));
}

TEST_F(CvatFile, RefusesWhatDoesNotFit) {
  const auto error = [](const std::string& text) { return read_error(kCvatHead + text + "</annotations>"); };
  EXPECT_EQ(error("<image id=\"0\"/>"),
            "t.txt:4: there are no <points>, <skeleton>, <polyline> or <polygon> in this file");
  EXPECT_EQ(error("<image><points label=\"eye\" points=\"1\"/></image>"),
            "t.txt:4: '1' in the points of 'eye'; x,y is expected");
  EXPECT_EQ(error("<image><points label=\"eye\" points=\"1,a\"/></image>"),
            "t.txt:4: landmark 'eye': y is 'a'; a number is needed");
  EXPECT_EQ(error("<image id=\"x\"/>"), "t.txt:4: id of <image> is 'x'; a whole number is needed");
  EXPECT_EQ(error("<image></track>"), "t.txt:4: </track> where </image> is expected");
}

// ---- points by name

TEST_F(PointsByName, MayStandInSeveralWays) {
  for (const std::string text :
       {R"({"tip": [1, 2], "fin": [3, 4]})", R"({"tip": {"x": 1, "y": 2}, "fin": {"x": 3, "y": 4}})",
        R"([{"name": "tip", "x": 1, "y": 2}, {"name": "fin", "x": 3, "y": 4}])",
        R"({"landmarks": [{"label": "tip", "x": 1, "y": 2}, {"label": "fin", "x": 3, "y": 4}], "version": 1})",
        R"({"points": {"tip": [1, 2], "fin": [3, 4]}})", R"({"keypoints": {"tip": [1, 2], "fin": [3, 4]}})"}) {
    const LandmarkFile file = read(text);
    EXPECT_EQ(file.format, "json") << text;
    ASSERT_EQ(file.shapes.size(), 1U) << text;
    EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4})) << text;
    EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip", "fin")) << text;
  }
}

TEST_F(PointsByName, MayBeOfSeveralShapes) {
  for (
      const std::string text :
      {R"({"b": {"tip": [1, 2], "fin": [3, null]}, "a": {"tip": [4, 5], "fin": [6, 7]}})",
       R"([{"name": "b", "points": {"tip": [1, 2], "fin": [3, null]}}, {"name": "a", "landmarks": {"tip": [4, 5], "fin": [6, 7]}}])"}) {
    const LandmarkFile file = read(text);
    ASSERT_EQ(file.shapes.size(), 2U) << text;
    EXPECT_EQ(file.shapes[0].name, "b") << text;
    EXPECT_TRUE(have_same_bits(file.shapes[0].points, points_2d({1, 2, 3, kNone}))) << text;
    EXPECT_THAT(file.shapes[1].labels, ElementsAre("tip", "fin")) << text;
  }
  const LandmarkFile lists = read(R"({"b": [[1, 2], [3, 4]], "a": [[5, 6], [7, 8]]})");
  EXPECT_EQ(lists.shapes.at(1).name, "a");
  EXPECT_EQ(lists.shapes.at(1).points, points_2d({5, 6, 7, 8}));
}

TEST_F(PointsByName, OfOtherKindsAreRefused) {
  for (const std::string text :
       {R"({"a": [1, 2], "b": [1, 2, 3]})", R"({"a": 1})", R"({"a": {"b": {"c": [1, 2]}}})", "{}"})
    EXPECT_THAT(read_error(text), HasSubstr("t.txt: the file holds no landmarks in a layout that is known")) << text;
}

}  // namespace
}  // namespace pulson::formats
