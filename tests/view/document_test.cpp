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

TEST(ViewDocument, RefusesWhatIsNone) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = json_of_document(example());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return error_of([&] { document_of_json("s.pulson.json", text); });
  };
  EXPECT_THAT(error_of([] { document_of_json("s.pulson.json", "{\"pulson_view\": 1"); }), HasSubstr("cut off"));
  EXPECT_THAT(error_of([] { document_of_json("s.pulson.json", "{}"); }), HasSubstr("pulson_view"));
  EXPECT_THAT(with("\"pulson_view\": 1", "\"pulson_view\": 2"), HasSubstr("version 1"));
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
  EXPECT_EQ(contents("a.pulson.json"), saved.json());
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
