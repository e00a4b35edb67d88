#pragma once

// What tests of real landmark files share: a file, what it holds by another program than ours, and the check.

#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

struct RealFile {
  std::string path;
  std::size_t shapes;
  int landmarks;  ///< of each shape; where they differ, of all together, and then `differ` is set
  std::vector<double> first;
  std::vector<double> last;
  std::string first_name{};  ///< empty: the file's stem
  std::string last_name{};
  std::size_t warnings = 0;
  std::size_t missing = 0;  ///< landmarks of all shapes that have a missing coordinate
  bool differ = false;
};

inline std::ostream& operator<<(std::ostream& stream, const RealFile& file) { return stream << file.path; }

inline std::filesystem::path data_folder() {
  const char* const given = std::getenv("PULSON_DATA");
  return given != nullptr ? std::filesystem::path(given)
                          : std::filesystem::path(PULSON_SOURCE_DIR) / ".." / "shared" / "data";
}

inline void expect_holds(const RealFile& expected) {
  const std::filesystem::path path = data_folder() / expected.path;
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "no " << path << "; PULSON_DATA may name the folder with the data";
  const LandmarkFile file = read_landmark_file(path);
  ASSERT_EQ(file.shapes.size(), expected.shapes);
  EXPECT_EQ(file.warnings.size(), expected.warnings);
  std::size_t missing = 0;
  int all = 0;
  for (const Landmarks& shape : file.shapes) {
    if (!expected.differ) {
      EXPECT_EQ(shape.count(), expected.landmarks) << shape.source;
    }
    EXPECT_EQ(shape.dimension(), static_cast<int>(expected.first.size())) << shape.source;
    missing += incomplete_points(shape.points).size();
    all += shape.count();
  }
  if (expected.differ) {
    EXPECT_EQ(all, expected.landmarks);
  }
  EXPECT_EQ(missing, expected.missing);
  const auto column = [](const auto& point) { return std::vector<double>(point.begin(), point.end()); };
  EXPECT_EQ(column(file.shapes.front().points.col(0)), expected.first);
  EXPECT_EQ(column(file.shapes.back().points.rightCols(1).reshaped()), expected.last);
  const std::filesystem::path stem = path.stem();
  const std::string own = (stem.extension() == ".mrk" ? stem.stem() : stem).string();
  const auto name_or_stem = [&](const std::string& name) { return name.empty() ? own : name; };
  EXPECT_EQ(file.shapes.front().name, name_or_stem(expected.first_name));
  EXPECT_EQ(file.shapes.back().name, name_or_stem(expected.last_name));
}

}  // namespace pulson::formats
