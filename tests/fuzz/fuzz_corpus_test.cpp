// Every file of the fuzzers' corpora once: as regression tests, also without clang.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "fuzz_targets.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::fuzz {

void PrintTo(const NamedTarget& target, std::ostream* stream) { *stream << target.name; }

namespace {

namespace fs = std::filesystem;

const fs::path kCorpus = fs::path(PULSON_SOURCE_DIR) / "tests/fuzz/corpus";

std::vector<fs::path> files_of(std::string_view target) {
  const fs::directory_iterator entries(kCorpus / target);
  std::vector<fs::path> files(begin(entries), end(entries));
  std::sort(files.begin(), files.end());
  return files;
}

std::string contents(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class FuzzCorpus : public testing::TestWithParam<NamedTarget> {};

TEST_P(FuzzCorpus, HasNoFindings) {
  const std::vector<fs::path> files = files_of(GetParam().name);
  EXPECT_FALSE(files.empty());
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.string());
    EXPECT_NO_THROW(EXPECT_TRUE(GetParam().run(contents(file))));
  }
}

std::string test_name(const testing::TestParamInfo<NamedTarget>& target) { return std::string(target.param.name); }

INSTANTIATE_TEST_SUITE_P(Targets, FuzzCorpus, testing::ValuesIn(kTargets), test_name);

TEST(FuzzCorpora, AreOfTargets) {
  std::set<std::string> names, folders;
  for (const NamedTarget& target : kTargets) names.emplace(target.name);
  for (const fs::directory_entry& entry : fs::directory_iterator(kCorpus)) folders.insert(entry.path().filename());
  EXPECT_EQ(folders, names);
}

TEST(FuzzCorpora, OfRandomShapesHaveNoFindings) {
  constexpr int kFiles = 3000;
  std::mt19937_64 random(1);
  for (int i = 0; i < kFiles; ++i) {
    std::string input(random() % 120, '\0');
    for (char& c : input) c = static_cast<char>(random() % (i % 2 == 0 ? 128 : 256));  // texts go on from 128
    ASSERT_NO_THROW(shapes(input)) << "file " << i;
  }
}

// Bytes that are changed, left out and doubled: whatever sizes a file claims.
TEST(FuzzCorpora, OfDamagedCarriedFilesHaveNoFindings) {
  constexpr int kDamages = 400;
  std::mt19937_64 random(2);
  for (const fs::path& file : files_of("carried_files"))
    for (int i = 0; i < kDamages; ++i) {
      std::string input = contents(file);
      for (std::size_t change = random() % 4; change < 4; ++change) {
        const std::size_t at = random() % input.size(), length = std::min(input.size() - at, 1 + random() % 16);
        if (change == 1) input.erase(at, length);
        if (change == 2) input.insert(at, input.substr(at, length));
        if (change != 1 && change != 2) input[at] = static_cast<char>(random() % 256);
        if (input.empty()) break;
      }
      ASSERT_NO_THROW(carried_files(input)) << file << ", damage " << i;
    }
}

/// Whether a seed of the targets that take `ROW\n` and a text is read by this row.
bool has_seed(const formats::LandmarkFormat& format) {
  for (const char* const target : {"point_lists", "tables", "arrays", "json_landmarks"})
    for (const fs::path& file : files_of(target)) {
      const std::string input = contents(file);
      if (!input.starts_with(format.name + "\n")) continue;
      try {
        format.read("f", std::string_view(input).substr(format.name.size() + 1));
        return true;
      } catch (const InputError&) {
        continue;
      }
    }
  return false;
}

TEST(FuzzCorpora, HaveASeedForEveryReader) {
  for (const formats::LandmarkFormat& format : formats::landmark_formats())
    EXPECT_TRUE(has_seed(format)) << format.name;
}

}  // namespace
}  // namespace pulson::fuzz
