// The gate that every record passes.

#include "records/record_text.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"

namespace pulson::records {
namespace {

using formats::Json;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(RecordText, NamesTheFirstNumberThatIsNotFinite) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(record_text({{"rms", 0.5}, {"count", 3}, {"lost", nullptr}}),
            "{\n  \"rms\": 0.5,\n  \"count\": 3,\n  \"lost\": null\n}\n");
  EXPECT_THAT(
      [&] {
        record_text({{"cost", {{"total", nan}}}});
      },
      ThrowsMessage<NumericalError>(HasSubstr("'cost.total' is nan")));
  const Json models = {{"models", Json::array({Json{{"rms", 1.0}}, Json{{"rms", infinity}}})}};
  EXPECT_THAT([&] { record_text(models); }, ThrowsMessage<NumericalError>(HasSubstr("'models[1].rms' is inf")));
  const Json positions = {{"q", Json::array({Json::array({1.0, 2.0}), Json::array({3.0, -infinity})})}};
  EXPECT_THAT([&] { require_finite(positions); }, ThrowsMessage<NumericalError>(HasSubstr("'q[1][1]' is -inf")));
}

TEST(RecordText, WritesNullForWhatMayBeUndefined) {
  const double nan = std::nan("");
  EXPECT_EQ(defined_or_null(nan), nullptr);
  EXPECT_EQ(defined_or_null(2.5), 2.5);
  EXPECT_EQ(defined_or_null({1.0, nan}), Json({1.0, nullptr}));
  EXPECT_EQ(defined_or_null({{"value", 1.0}, {"standard_error", nan}}),
            Json({{"value", 1.0}, {"standard_error", nullptr}}));
}

// Each text of a record is made by the gate, so that a new verb cannot leave it out.
TEST(RecordText, IsTheOnlyWayOfARecordIntoAFile) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  const std::regex ungated(R"(return (json\.dump\(|formats::one_key_a_line\(json))");
  int files = 0;
  for (const char* folder : {"apps", "src/records"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".cpp") continue;
      // Tables of what the program knows, and parts of runs, which hold results as they come.
      const std::string name = entry.path().filename().string();
      if (name == "info.cpp" || name == "unit_parts.cpp") continue;
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      EXPECT_FALSE(std::regex_search(text, ungated)) << entry.path();
      ++files;
    }
  EXPECT_GT(files, 50);
}

}  // namespace
}  // namespace pulson::records
