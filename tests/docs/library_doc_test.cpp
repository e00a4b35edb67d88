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

std::string whole(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Calls use(match) for each match of the pattern.
template <class Use>
void for_each_match(const std::string& text, const char* pattern, const Use& use) {
  const std::regex expression(pattern);
  for (std::sregex_iterator match(text.begin(), text.end(), expression), none; match != none; ++match) use(*match);
}

// "Where is …" of docs/architecture.md: the files are there, and so is what is said to be in them.
TEST(ArchitectureDocument, NamesWhatIsThere) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  const std::string page = whole(root / "docs/architecture.md"), table = page.substr(page.find("## Where is"));
  int files = 0, names = 0;
  for_each_match(table, "`((?:src|apps|include|tests)/[a-z0-9_/.]+)`", [&](const std::smatch& match) {
    ++files;
    EXPECT_TRUE(std::filesystem::exists(root / match.str(1))) << match.str(1);
  });
  for_each_match(
      table, "`(?:[A-Za-z]+::)?([a-zA-Z_]+)`[^`|]* in `([a-z0-9_/]+[.][a-z]+)`", [&](const std::smatch& match) {
        ++names;
        EXPECT_THAT(whole(root / match.str(2)), testing::ContainsRegex(match.str(1) + "[^a-z_]")) << match.str(2);
      });
  EXPECT_GE(files, 20);
  EXPECT_GE(names, 8);
}

}  // namespace
}  // namespace pulson
