#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/text.hpp"
#include "temporary_folder.hpp"

namespace pulson {

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

inline std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t i = text.find(part); i != std::string::npos; i = text.find(part, i + part.size())) ++count;
  return count;
}

/// Every element of the XML text is closed in order, no bare '&' and no character occurs that XML forbids.
inline bool is_balanced_xml(const std::string& text) {
  if (!is_utf8(text) || contains(text, "\xEF\xBF\xBE") || contains(text, "\xEF\xBF\xBF")) return false;
  for (const char c : text)
    if (static_cast<unsigned char>(c) < 0x20 && c != '\n') return false;
  std::vector<std::string> open;
  for (std::size_t i = text.find('<'); i != std::string::npos; i = text.find('<', i + 1)) {
    const std::size_t end = text.find('>', i);
    if (end == std::string::npos) return false;
    const std::string name = text.substr(i + 1, text.find_first_of(" \t\n/>", i + 2) - i - 1);
    if (name.starts_with('?') || text[end - 1] == '/') continue;
    if (!name.starts_with('/')) {
      open.push_back(name);
    } else {
      if (open.empty() || "/" + open.back() != name) return false;
      open.pop_back();
    }
  }
  for (std::size_t i = text.find('&'); i != std::string::npos; i = text.find('&', i + 1))
    if (text.find(';', i) > i + 6) return false;
  return open.empty() && contains(text, "</svg>");
}

/// Width and height of a PNG: big-endian numbers at byte 16.
inline std::pair<int, int> size_of_png(const std::string& png) {
  const auto number = [&](std::size_t first) {
    int value = 0;
    for (std::size_t i = first; i < first + 4; ++i) value = 256 * value + static_cast<unsigned char>(png.at(i));
    return value;
  };
  return {number(16), number(20)};
}

/// For tests of what draws a PNG and an SVG of one layout.
class PictureTest : public InTemporaryFolder {
 protected:
  static constexpr std::size_t kLargestSvg = 2000000;

  static std::set<std::string> files() {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(".")) names.insert(entry.path().filename().string());
    return names;
  }

  /// Expects two whole files of one size, in which nothing is of no number; returns the SVG's text.
  static std::string expect_whole_pictures(const std::filesystem::path& png_file,
                                           const std::filesystem::path& svg_file) {
    const std::string png = contents(png_file.string()), svg = contents(svg_file.string());
    EXPECT_GT(png.size(), 5000u);
    if (png.size() < 24) return svg;
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
    const std::uint32_t width = big_endian(png, 16), height = big_endian(png, 20);
    EXPECT_GE(width, 1200u);
    EXPECT_LE(width, 1600u);
    EXPECT_GE(height, 400u);
    EXPECT_LE(height, 1700u);
    EXPECT_TRUE(is_balanced_xml(svg));
    EXPECT_LT(svg.size(), kLargestSvg);
    const std::string size = "width=\"" + std::to_string(width) + "\" height=\"" + std::to_string(height) + "\"";
    EXPECT_TRUE(contains(svg, size)) << "the two differ in layout";
    for (const char* bad : {"nan", "inf,", "inf "}) EXPECT_FALSE(contains(svg, bad)) << bad;
    return svg;
  }

 private:
  static std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = 256 * value + static_cast<unsigned char>(bytes[i]);
    return value;
  }
};

}  // namespace pulson
