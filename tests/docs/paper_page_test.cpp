// docs/paper.md: every file, function and test that it names is there.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gtest/gtest.h>

namespace pulson {
namespace {

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// In a row a file is followed by what is in it: functions and classes by their names, tests as Suite.Name.
TEST(PaperPage, NamesFilesWithTheFunctionsAndTestsThatTheyHold) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  std::ifstream page(root / "docs/paper.md");
  const std::regex word("`([^`]+)`"), file("(apps|include|src|tests)/.*\\.[ch]pp"), test("(\\w+)\\.(\\w+)");
  int files = 0, names = 0;
  for (std::string line; std::getline(page, line);) {
    std::string contents;
    for (std::sregex_iterator found(line.begin(), line.end(), word), end; found != end; ++found) {
      const std::string text = (*found)[1];
      std::smatch parts;
      if (std::regex_match(text, file)) {
        EXPECT_TRUE(std::filesystem::exists(root / text)) << text;
        contents = text_of_file(root / text);
        ++files;
      } else if (!contents.empty() && std::regex_match(text, parts, test)) {
        const std::regex definition("TEST(_P|_F)?\\(" + parts[1].str() + ", " + parts[2].str() + "\\)");
        EXPECT_TRUE(std::regex_search(contents, definition)) << text;
        ++names;
      } else if (!contents.empty() && std::regex_match(text, std::regex("\\w+"))) {
        EXPECT_NE(contents.find(text), std::string::npos) << text;
        ++names;
      }
    }
  }
  EXPECT_GE(files, 20);
  EXPECT_GE(names, 20);
}

}  // namespace
}  // namespace pulson
