// Landmarks in JSON: what is read, what is written, what is refused.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using testing::StartsWith;

using JsonFile = ReadingTexts;

TEST_F(JsonFile, IsReadInEachLayout) {
  const Points points = points_2d({0, 1, 2.5, -3});
  const std::string list = "[[0, 1], [2.5, -3]]";
  for (const std::string& text :
       {list, "{\"points\": " + list + "}", "\n{\"shapes\": [{\"points\": " + list + "}]}", "\xEF\xBB\xBF" + list}) {
    const LandmarkFile file = read(text);
    EXPECT_EQ(file.format, "json");
    ASSERT_EQ(file.shapes.size(), 1U);
    EXPECT_EQ(file.shapes[0].points, points);
    EXPECT_EQ(file.shapes[0].name, "t");
    EXPECT_THAT(file.warnings, IsEmpty());
  }
  EXPECT_EQ(read("[[1], [2]]").shapes[0].dimension(), 1);
  EXPECT_THAT(incomplete_points(read("[null, [1, 2, 3], [null, 1, 2]]").shapes[0].points), ElementsAre(0, 2));
  EXPECT_EQ(read("[]").shapes[0].count(), 0);
}

TEST_F(JsonFile, TakesListsOfShapes) {
  const auto shapes = [](const std::string& text) { return read(text).shapes; };
  const std::vector<Landmarks> pair = shapes("[[[1, 2], [3, 4]], [[5, 6], null, [7, 8]]]");
  ASSERT_THAT(pair, SizeIs(2));
  EXPECT_EQ(pair[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(pair[0].name, "t#1");
  EXPECT_THAT(incomplete_points(pair[1].points), ElementsAre(1));
  EXPECT_THAT(shapes("[[[1, 2]]]"), SizeIs(1));
  EXPECT_THAT(shapes("[[], [[1, 2]]]"), SizeIs(2));
  EXPECT_EQ(read_error("[[[1, 2]], [3, 4]]"), "t.txt: '[1][0]' is not a list of 1, 2 or 3 numbers");
  EXPECT_EQ(read_error("[[[[1, 2]]]]"), "t.txt: '[0][0]' is not a list of 1, 2 or 3 numbers");
  EXPECT_EQ(read_error("[null, [[1, 2]]]"), "t.txt: '[0]' is not a list of points [x, y]");
}

TEST_F(JsonFile, TakesNanOfPython) {
  const Landmarks shape =
      read(R"({"points": [[NaN, NaN], [1, 2], [NaN,3]], "labels": ["NaN", "\"NaN", "a\\"]})").shapes[0];
  EXPECT_THAT(incomplete_points(shape.points), ElementsAre(0, 2));
  EXPECT_THAT(shape.labels, ElementsAre("NaN", "\"NaN", "a\\"));
  EXPECT_EQ(read_error("[[1,\n Infinity]]"),
            "t.txt:2: column 2: not valid JSON: Infinity; a coordinate must be finite, or null where it is missing");
  EXPECT_THAT(read_error("[[1, NaN], [-Infinity, 1]]"), HasSubstr(": not valid JSON: Infinity; a coordinate must"));
  EXPECT_THAT(read_error("[[1, -NaN]]"), HasSubstr("not valid JSON: "));
  EXPECT_THAT(read_error("[[1, NaNs]]"), HasSubstr("not valid JSON: "));
  EXPECT_THAT(read_error("[[1, \"NaN]]\\"), HasSubstr("not valid JSON: "));
}

TEST_F(JsonFile, TakesAllThatItsHelpSays) {
  const auto& formats = landmark_formats();
  const auto row =
      std::find_if(formats.begin(), formats.end(), [](const auto& format) { return format.name == "json"; });
  ASSERT_NE(row, formats.end());
  const LandmarkFile file = read(row->help.substr(0, row->help.rfind("; only points")));
  EXPECT_EQ(file.units, "mm");
  EXPECT_EQ(file.axes, "RAS");
  EXPECT_THAT(file.warnings, IsEmpty());
  const Landmarks& shape = file.shapes.at(0);
  EXPECT_EQ(shape.name, "a");
  EXPECT_THAT(missing_landmarks(shape), ElementsAre(1));
  EXPECT_THAT(shape.absent, ElementsAre(2));
  EXPECT_THAT(shape.labels, ElementsAre("tip", "fin", "bone"));
  EXPECT_THAT(shape.groups, ElementsAre("1", "1", "2"));
  EXPECT_EQ(shape.image, "a.jpg");
  EXPECT_EQ(shape.scale, 0.1);
  EXPECT_THAT(shape.properties, ElementsAre(Pair("COMMENT", "old")));
  ASSERT_THAT(shape.curves, SizeIs(1));
  EXPECT_EQ(shape.curves[0], points_2d({0, 1, 2, 3}));
  EXPECT_THAT(shape.outlines, IsEmpty());
}

TEST_F(JsonFile, TakesARegistration) {
  const LandmarkFile file = read(R"({"format": "pulson registration 1",
    "source_shape": {"file": "a.csv", "name": "a", "labels": ["tip", "fin"], "groups": []},
    "target_shape": {"file": "b.csv", "name": "b", "labels": [], "groups": ["1", "1"]},
    "source": [[1, 2], [3, 4]], "target": [[5, 6], [null, 8]], "result": [[9, 10], [11, 12]], "momenta": [[0, 0]]})");
  EXPECT_THAT(file.warnings, IsEmpty());
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[0].name, "source");
  EXPECT_EQ(file.shapes[1].name, "target");
  EXPECT_EQ(file.shapes[2].name, "result");
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(incomplete_points(file.shapes[1].points), ElementsAre(1));
  EXPECT_THAT(file.shapes[1].groups, ElementsAre("1", "1"));
  EXPECT_EQ(file.shapes[2].points, points_2d({9, 10, 11, 12}));
  EXPECT_THAT(file.shapes[2].labels, ElementsAre("tip", "fin"));
}

TEST_F(JsonFile, IsRefusedByPlace) {
  EXPECT_EQ(read_error("{\"shapes\": 7}"), "t.txt: 'shapes' is not a list");
  EXPECT_EQ(read_error("{\"shapes\": []}"), "t.txt: 'shapes' is empty; a shape is needed");
  EXPECT_EQ(read_error("{\"shapes\": [7]}"), "t.txt: 'shapes[0]' is not an object with the key 'points'");
  EXPECT_EQ(read_error("{\"shapes\": [{}]}"), "t.txt: 'shapes[0].points' is missing");
  EXPECT_EQ(read_error("[[1, 2], 3]"), "t.txt: '[1]' is not a list of 1, 2 or 3 numbers");
  EXPECT_EQ(read_error("{\"points\": [[1, 2], [3]]}"), "t.txt: 'points[1]' has 1 number; the first point has 2");
  EXPECT_EQ(read_error("{\"points\": [[1, 2], [3, \"x\"]]}"), "t.txt: 'points[1]' is not a list of 1, 2 or 3 numbers");
  EXPECT_EQ(read_error("{\"points\": [[1, 2]], \"labels\": [\"a\", \"b\"]}"),
            "t.txt: 'labels' has 2 items for 1 point");
  EXPECT_EQ(read_error("{\"points\": [[1, 2]], \"labels\": [1]}"), "t.txt: 'labels' has no string as item 1");
  EXPECT_EQ(
      read_error("{\"a\": 1}"),
      "t.txt: the file holds no landmarks in a layout that is known: an object with the key 'shapes' or 'points', "
      "points by name such as {\"tip\": [1, 2]}, or a list of points");
}

TEST_F(JsonFile, SaysWhereItIsNoJson) {
  EXPECT_THAT(read_error("{\"points\": [\n[1, 2],\n[3 4]]}"),
              StartsWith("t.txt:3: column 4: not valid JSON: syntax error while parsing array"));
  EXPECT_THAT(read_error("[[1, 2]"), HasSubstr("t.txt:1: column 8: not valid JSON: "));
  EXPECT_EQ(read_error("[[1e999]]"), "t.txt: not valid JSON: number overflow parsing '1e999'");
  EXPECT_THAT(read_error("[[nan]]"), StartsWith("t.txt:1: column 4: not valid JSON: "));
  EXPECT_THAT(read_error("[\"" + std::string(100000, 'x') + "\n\"]"), EndsWith("..."));
  EXPECT_THAT(read_error(std::string(200000, '[')), HasSubstr("not valid JSON"));
}

TEST_F(JsonFile, TellsKeysThatItDoesNotKnow) {
  EXPECT_THAT(
      read(R"({"shapes": [{"points": [[1]], "lables": []}, {"points": [[1]], "lables": []}], "unit": "mm"})").warnings,
      ElementsAre("t.txt: the key 'lables' is not used", "t.txt: the key 'unit' is not used"));
}

TEST_F(JsonFile, IsWrittenToTheBits) {
  LandmarkFile file;
  for (int d = 1; d <= 3; ++d) {
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = hard_points(d, 20, static_cast<unsigned>(d));
    shape.points(0, 7) = std::nan("");
    shape.name = "fish\n\"" + std::to_string(d) + "\"";
    shape.image = "C:\\fish.jpg";
    shape.scale = 0.1;
    shape.labels.assign(20, "tip");
    shape.groups.assign(20, "rim");
    shape.curves = {hard_points(d, 7), hard_points(d, 2)};
    shape.outlines = {hard_points(d, 9)};
  }
  file.shapes[0].properties = {{"A", "1"}, {"B", "2"}};
  file.shapes[1].properties = {{"B", "1"}, {"A", "2"}};
  file.shapes[2].properties = {{"A", "1"}, {"A", "2"}};
  file.units = "mm";
  file.axes = "RAS";
  EXPECT_THAT(write_landmark_file("t.json", file), IsEmpty());
  const LandmarkFile back = read_landmark_file("t.json");
  EXPECT_THAT(back.warnings, IsEmpty());
  EXPECT_EQ(back.units, "mm");
  EXPECT_EQ(back.axes, "RAS");
  ASSERT_EQ(back.shapes.size(), 3U);
  for (std::size_t s = 0; s < 3; ++s) {
    const Landmarks& shape = back.shapes[s];
    EXPECT_TRUE(have_same_bits(shape.points, file.shapes[s].points));
    EXPECT_EQ(shape.name, file.shapes[s].name);
    EXPECT_EQ(shape.image, file.shapes[s].image);
    EXPECT_EQ(shape.scale, file.shapes[s].scale);
    EXPECT_EQ(shape.labels, file.shapes[s].labels);
    EXPECT_EQ(shape.groups, file.shapes[s].groups);
    EXPECT_EQ(shape.properties, file.shapes[s].properties);
    ASSERT_THAT(shape.curves, SizeIs(2));
    EXPECT_TRUE(have_same_bits(shape.curves[1], file.shapes[s].curves[1]));
    ASSERT_THAT(shape.outlines, SizeIs(1));
    EXPECT_TRUE(have_same_bits(shape.outlines[0], file.shapes[s].outlines[0]));
  }
}

TEST_F(JsonFile, TellsOfNamesThatAreNoText) {
  LandmarkFile file = one_shape(points_2d({1, 2}));
  file.shapes[0].name = "poisson \xE9";
  EXPECT_THAT(write_landmark_file("t.json", file),
              ElementsAre("t.json: bytes in names that are not UTF-8 are replaced"));
  EXPECT_EQ(read_landmarks("t.json").points, points_2d({1, 2}));
}

// ---- annotations of LabelMe

std::string labelme(const std::string& annotations) {
  return R"({"version": "5.0.1", "flags": {}, "shapes": [)" + annotations +
         R"(], "imagePath": "wing.jpg", "imageData": null, "imageHeight": 9, "imageWidth": 9})";
}

std::string annotation(const std::string& kind, const std::string& label, const std::string& points,
                       const std::string& group = "null") {
  return R"({"label": )" + label + R"(, "points": )" + points + R"(, "group_id": )" + group + R"(, "shape_type": ")" +
         kind + R"(", "flags": {}})";
}

TEST_F(JsonFile, OfLabelmeIsOneShape) {
  const LandmarkFile file = read(labelme(annotation("point", "\"tip\"", "[[1, 2]]") + ", " +
                                         annotation("linestrip", "\"rim\"", "[[1, 2], [3, 4], [5, 6]]") + ", " +
                                         annotation("point", "7", "[[3.5, 4]]") + ", " +
                                         annotation("polygon", "\"cell\"", "[[1, 2], [3, 4], [5, 7]]")));
  EXPECT_EQ(file.format, "labelme");
  EXPECT_THAT(file.warnings, IsEmpty());
  ASSERT_THAT(file.shapes, SizeIs(1));
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3.5, 4}));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("tip", "7"));
  EXPECT_THAT(file.shapes[0].groups, IsEmpty());
  EXPECT_EQ(file.shapes[0].image, "wing.jpg");
  EXPECT_EQ(file.shapes[0].name, "t");
  EXPECT_THAT(file.shapes[0].curves, ElementsAre(points_2d({1, 2, 3, 4, 5, 6})));
  EXPECT_THAT(file.shapes[0].outlines, ElementsAre(points_2d({1, 2, 3, 4, 5, 7})));
  EXPECT_EQ(read(labelme("")).shapes[0].count(), 0);
}

TEST_F(JsonFile, OfLabelmeMayHoldOutlinesAlone) {
  const LandmarkFile file = read(labelme(annotation("polygon", "\"cell\"", "[[1, 2], [3, 4], [5, 7]]") + ", " +
                                         annotation("line", "\"axis\"", "[[0, 2], [3, 5]]")));
  EXPECT_THAT(file.warnings, ElementsAre("t.txt: 1 shape without landmarks: the points of curves and outlines are "
                                         "taken as landmarks, one group for each"));
  EXPECT_EQ(file.shapes[0].points, points_2d({0, 2, 3, 5, 1, 2, 3, 4, 5, 7}));
  EXPECT_THAT(file.shapes[0].groups, ElementsAre("curve 1", "curve 1", "outline 1", "outline 1", "outline 1"));
}

TEST_F(JsonFile, OfLabelmeMayHaveGroups) {
  const LandmarkFile all = read(labelme(annotation("point", "\"tip\"", "[[1, 2]]", "0") + ", " +
                                        annotation("point", "\"tip\"", "[[3, 4]]", "1")));
  EXPECT_THAT(all.shapes[0].groups, ElementsAre("0", "1"));
  EXPECT_THAT(all.warnings, IsEmpty());
  const LandmarkFile one = read(
      labelme(annotation("point", "\"tip\"", "[[1, 2]]", "0") + ", " + annotation("point", "\"tip\"", "[[3, 4]]")));
  EXPECT_THAT(one.shapes[0].groups, IsEmpty());
  EXPECT_THAT(one.warnings, ElementsAre("t.txt: a group_id that not all points have is not used"));
}

TEST_F(JsonFile, OfLabelmeTellsWhatIsNoLandmarkAndNoLine) {
  EXPECT_THAT(read(labelme(annotation("rectangle", "\"fish\"", "[[1, 2], [3, 4]]") + ", " +
                           annotation("polygon", "\"none\"", "[]")))
                  .warnings,
              ElementsAre("t.txt: the 'rectangle' 'fish' of LabelMe is not used",
                          "t.txt: the 'polygon' 'none' of LabelMe is not used"));
  EXPECT_EQ(read_error(labelme("7")), "t.txt: 'shapes[0]' is not an object");
  EXPECT_EQ(read_error(labelme(annotation("point", "\"a\"", "[[1, 2, 3]]"))),
            "t.txt: 'shapes[0].points' is not a list of points [x, y]");
  EXPECT_EQ(read_error(labelme(annotation("point", "\"a\"", "7"))),
            "t.txt: 'shapes[0].points' is not a list of points [x, y]");
  EXPECT_EQ(read_error(R"({"imagePath": "a.jpg"})"), "t.txt: 'shapes' is missing");
}

TEST_F(JsonFile, OfLabelmeIsToldFromOthersByItsKeys) {
  EXPECT_EQ(read(R"({"shapes": [{"label": "a", "points": [[1, 2]], "shape_type": "point"}]})").format, "labelme");
  EXPECT_EQ(read(R"({"imagePath" : "a.jpg", "shapes": [{"label": "a", "points": [[1, 2]]}]})").format, "labelme");
  for (const std::string text :
       {R"({"shapes": [{"points": [[1, 2]], "labels": ["shape_type"], "properties": {"shape_type": "x"}}]})",
        R"({"points": [[1, 2]], "labels": ["imagePath"], "properties": {"imagePath": "\"imagePath\": "}})"})
    EXPECT_EQ(read(text).format, "json") << text;
}

// ---- options of reading

TEST_F(JsonFile, MayHaveNegativesForMissingOnes) {
  write("t.json", "{\"shapes\": [{\"points\": [[1, 2], [-1, 5], [0, -0.0]]}, {\"points\": [[-1, -1]]}]}");
  EXPECT_THAT(incomplete_points(read_landmark_file("t.json").shapes[0].points), IsEmpty());
  const Landmarks first = read_landmarks("t.json#1", nullptr, {.negative_is_missing = true});
  EXPECT_THAT(incomplete_points(first.points), ElementsAre(1));
  EXPECT_TRUE(first.points.col(1).array().isNaN().all());
  const LandmarkFile second = read_addressed_shapes("t.json#2", {.negative_is_missing = true});
  ASSERT_EQ(second.shapes.size(), 1U);
  EXPECT_THAT(incomplete_points(second.shapes[0].points), ElementsAre(0));
  EXPECT_EQ(second.format, "json");
  EXPECT_EQ(read_addressed_shapes("t.json").shapes.size(), 2U);
}

// menpo's points are rows and columns.
TEST_F(JsonFile, OfMenpoHasGroupsAsShapes) {
  const std::string group =
      R"({"labels": [{"label": "eye", "mask": [0, 1]}, {"label": "mouth", "mask": [2]}], "landmarks": {"points": )"
      R"([[1, 2], [3, 4], [5, null]]}})";
  const LandmarkFile file = read(R"({"groups": {"LJSON": )" + group + R"(}, "version": 3})");
  EXPECT_EQ(file.format, "menpo");
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_EQ(file.shapes[0].name, "LJSON");
  EXPECT_EQ(file.shapes[0].points.leftCols(2), (Points{{2.0, 4.0}, {1.0, 3.0}}));
  EXPECT_TRUE(std::isnan(file.shapes[0].points(0, 2)));
  EXPECT_THAT(file.shapes[0].groups, testing::ElementsAre("eye", "eye", "mouth"));
  const LandmarkFile older =
      read(R"({"labels": [{"label": "all", "mask": [0]}], "landmarks": {"points": [[1, 2], [3, 4]]}, "version": 2})");
  EXPECT_EQ(older.shapes[0].points, (Points{{2.0, 4.0}, {1.0, 3.0}}));
  EXPECT_TRUE(older.shapes[0].groups.empty());  // the second point has none
}

TEST_F(JsonFile, OfMenpoIsRefusedByPlace) {
  EXPECT_EQ(
      read_error(R"({"groups": {"a": {"labels": [{"label": "x", "mask": [7]}], "landmarks": {"points": [[1, 2]]}}},)"
                 R"( "version": 3})"),
      "t.txt: 'groups.a.labels[0].mask[0]' is not the number of a point");
  EXPECT_EQ(read_error(R"({"groups": {"a": {"labels": [], "landmarks": {"points": 7}}}, "version": 3})"),
            "t.txt: 'groups.a.landmarks.points' is not a list of points [x, y]");
}

}  // namespace
}  // namespace pulson::formats
