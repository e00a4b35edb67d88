#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <stdlib.h>

#include "error_of.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// A folder of its own for each test, which is the working folder while it runs.
class InTemporaryFolder : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "pulson_io_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    before_ = std::filesystem::current_path();
    std::filesystem::current_path(folder_);
  }
  void TearDown() override {
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(folder_);
  }

  static void write(const std::string& name, const std::string& text) { std::ofstream(name, std::ios::binary) << text; }

  static std::string contents(const std::string& name) {
    std::ifstream stream(name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  static std::size_t count_entries() {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator("."), std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path folder_;
  std::filesystem::path before_;
};

/// The columns of a 2-row matrix from x0, y0, x1, y1, ...
inline Points points_2d(std::vector<double> numbers) {
  return Points::Map(numbers.data(), 2, static_cast<Eigen::Index>(numbers.size() / 2));
}

}  // namespace pulson
