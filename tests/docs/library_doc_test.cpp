// docs/library.md shows parts of apps/examples, and nothing else.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pulson {
namespace {

// Of a file, lines without their indentation.
std::string lines_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return std::regex_replace(text, std::regex("\n +"), "\n");
}

TEST(LibraryDocument, ShowsTheExamples) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  std::string examples;
  for (const auto& entry : std::filesystem::directory_iterator(root / "apps/examples"))
    if (entry.path().extension() == ".cpp") examples += lines_of(entry.path());
  const std::string document = lines_of(root / "docs/library.md");
  int snippets = 0;
  const std::string begin = "```cpp\n";
  for (std::size_t at = document.find(begin); at != std::string::npos; at = document.find(begin, at + 1), ++snippets) {
    const std::size_t first = at + begin.size();
    EXPECT_THAT(examples, testing::HasSubstr(document.substr(first, document.find("```", first) - first)));
  }
  EXPECT_GE(snippets, 6);
}

}  // namespace
}  // namespace pulson
