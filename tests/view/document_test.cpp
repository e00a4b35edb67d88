#include "view/document.hpp"

#include <gmock/gmock.h>

#include "error_of.hpp"
#include "pulson/core/errors.hpp"
#include "temporary_folder.hpp"
#include "view/saved_document.hpp"

namespace pulson::view {
namespace {

using testing::HasSubstr;

ViewDocument example() {
  ViewDocument document;
  document.landmarks = {{"tip", ""}, {"", "curve 1"}};
  document.links = {{0, 1}};
  document.specimens = {{"a", "a.png", 30, 40}, {"b", "b.png", 50, 60}};
  document.specimens[0].landmarks = {{Placement::kPlaced, {1.25, 2.5}}, {Placement::kMissing}};
  document.specimens[1].landmarks = {{Placement::kAbsent}, {}};
  document.specimens[1].second_pass = {{}, {Placement::kPlaced, {3, 4}}};
  document.shown = {1, 0};
  return document;
}

TEST(ViewDocument, IsReadAsItIsWritten) {
  const std::string text = json_of_document(example());
  const ViewDocument read = document_of_json("x", text);
  EXPECT_EQ(json_of_document(read), text);
  EXPECT_EQ(read.specimens[0].landmarks[0].position, Eigen::Vector2d(1.25, 2.5));
  EXPECT_EQ(read.specimens[0].landmarks[1].placement, Placement::kMissing);
  EXPECT_EQ(read.specimens[1].landmarks[0].placement, Placement::kAbsent);
  EXPECT_EQ(read.specimens[1].second_pass[1].placement, Placement::kPlaced);
  EXPECT_EQ(read.shown, (std::array{1, 0}));
}

// A shape with all that a file may say of it.
OpenedShape example_shape() {
  OpenedShape opened;
  Landmarks& shape = opened.shape;
  shape.points.resize(2, 0);
  shape.name = "a";
  shape.image = "a.png";
  shape.scale = 0.1;
  shape.properties = {{"COMMENT", "old"}, {"COMMENT", "older"}};
  shape.curves = {Points{{0, 1}, {2.5, 3}}};
  shape.units = "mm";
  shape.axes = "RAS";
  shape.source = "a.tps#1";
  opened.frame = {.origin = {1, 2}, .unit_per_pixel = {0.1, 0.2}, .y_down = false, .height = 30, .width = 40};
  shape.frame = opened.frame;
  shape.frame.says_units = true;
  opened.orientation = 6;
  return opened;
}

TEST(ViewDocument, KeepsShapesOfFilesButNotOnThePage) {
  ViewDocument document = example();
  document.shapes["a.tps#1"] = example_shape();
  document.specimens[0].shape = "a.tps#1";
  const std::string text = json_of_document(document);
  const ViewDocument read = document_of_json("x", text);
  EXPECT_EQ(json_of_document(read), text);
  const OpenedShape& opened = read.shapes.at("a.tps#1");
  EXPECT_EQ(opened.shape.scale, 0.1);
  EXPECT_EQ(opened.shape.properties, example_shape().shape.properties);
  EXPECT_EQ(opened.shape.curves, example_shape().shape.curves);
  EXPECT_EQ(opened.shape.units + opened.shape.axes + opened.shape.source, "mmRASa.tps#1");
  EXPECT_EQ(opened.frame.unit_per_pixel, (std::array{0.1, 0.2}));
  EXPECT_FALSE(opened.frame.says_units);
  EXPECT_TRUE(opened.shape.frame.says_units);
  EXPECT_EQ(opened.width(), 30);
  document.shapes.clear();
  const std::string page = json_of_document(document);
  EXPECT_EQ(json_of_document(document_of_page(page, read.shapes)), text);
  EXPECT_THAT(error_of([&] { document_of_json("s", page); }), HasSubstr("s: 'shapes' lacks a.tps#1"));
}

// Decimal digits as files have them, for every orientation and either direction of y.
TEST(ViewDocument, CoordinatesComeBackFromThePageToTheBit) {
  const Points points{{50.58, 0.1, -3, 1e-7, 299.99}, {142.52, 358.51, 7.25, 33, 0.3}};
  for (int orientation = 1; orientation <= 8; ++orientation)
    for (const bool y_down : {false, true}) {
      OpenedShape opened;
      opened.frame = {
          .origin = {0.5, -2}, .unit_per_pixel = {0.02, 0.03}, .y_down = y_down, .height = 400, .width = 300};
      opened.orientation = orientation;
      EXPECT_EQ(opened.from_page(opened.to_page(points)), points) << orientation << y_down;
    }
}

TEST(ViewDocument, RefusesWhatIsNone) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = json_of_document(example());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return error_of([&] { document_of_json("s.pulson.json", text); });
  };
  EXPECT_THAT(error_of([] { document_of_json("s.pulson.json", "{\"pulson_view\": 2"); }), HasSubstr("cut off"));
  EXPECT_THAT(error_of([] { document_of_json("s.pulson.json", "{}"); }), HasSubstr("pulson_view"));
  EXPECT_THAT(with("\"pulson_view\": 2", "\"pulson_view\": 1"), HasSubstr("version 2"));
  EXPECT_THAT(with("1.25", "1e99"), HasSubstr("far beyond"));
  EXPECT_THAT(with("\"missing\"", "\"lost\""), HasSubstr("'points'"));
  EXPECT_THAT(with("\"width\": 30", "\"width\": 0"), HasSubstr("'width' is 0"));
  EXPECT_THAT(with("\"missing\"", "\"missing\", null"), HasSubstr("3 entries for 2 landmarks"));
  EXPECT_THAT(with("\"links\": [\n  [\n   0", "\"links\": [\n  [\n   7"), HasSubstr("'links'"));
}

class SavedViewDocument : public InTemporaryFolder {};

TEST_F(SavedViewDocument, HoldsWhatItsFileHolds) {
  SavedDocument saved("a.pulson.json");
  EXPECT_FALSE(saved.load());
  EXPECT_EQ(saved.replace(example(), 0), SavedDocument::Outcome::kSaved);
  EXPECT_EQ(contents("a.pulson.json"), json_of_document(saved.document()));
  EXPECT_EQ(saved.document().revision, 1);
}

TEST_F(SavedViewDocument, TakesNoChangeOfAnOlderState) {
  SavedDocument saved("a.pulson.json");
  saved.replace(example(), 0);
  const std::string before = contents("a.pulson.json");
  EXPECT_EQ(saved.replace(ViewDocument{}, 0), SavedDocument::Outcome::kConflict);
  EXPECT_EQ(contents("a.pulson.json"), before);
}

TEST_F(SavedViewDocument, IsOpenedOnce) {
  const SavedDocument first("a.pulson.json");
  EXPECT_THROW(SavedDocument("a.pulson.json"), InputError);
}

}  // namespace
}  // namespace pulson::view
