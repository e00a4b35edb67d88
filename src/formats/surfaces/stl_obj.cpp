// Stereolithography files, whose triangles have corners of their own, and Wavefront's obj.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "surface_files.hpp"

namespace pulson::formats {
namespace {

Surface read_binary_stl(std::string_view text, std::size_t count) {
  SharedCorners corners;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 12> numbers{};  // the normal, three corners
    std::memcpy(numbers.data(), text.data() + kStlHead + 4 + kStlTriangle * i, sizeof numbers);
    for (std::size_t k = 3; k < 12; k += 3) corners.add({numbers.at(k), numbers.at(k + 1), numbers.at(k + 2)});
  }
  return corners.surface();
}

}  // namespace

std::array<double, 3> numbers_behind_word(const std::string& path, const text::TextLine& line,
                                          const std::vector<std::string_view>& words) {
  if (words.size() < 4) text::fail(path, line.number, "a vertex has three coordinates");
  std::array<double, 3> place{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    place.at(axis) = text::parse_coordinate(words[axis + 1], {path, line.number, "a vertex", "", axis});
  return place;
}

void SharedCorners::add(const std::array<double, 3>& place) {
  int number = static_cast<int>(coordinates_.size() / 3);
  bool is_new = true;
  if (std::none_of(place.begin(), place.end(), [](double x) { return std::isnan(x); })) {
    const auto [found, inserted] = numbers_.try_emplace(place, number);
    number = found->second;
    is_new = inserted;
  }
  if (is_new) coordinates_.insert(coordinates_.end(), place.begin(), place.end());
  corners_.push_back(number);
}

Points SharedCorners::vertices() const { return text::points_from(coordinates_, 3); }

Surface SharedCorners::surface() const {
  Surface surface;
  surface.vertices.points = vertices();
  for (std::size_t i = 0; i + 2 < corners_.size(); i += 3)
    surface.triangles.push_back({corners_[i], corners_[i + 1], corners_[i + 2]});
  return surface;
}

std::optional<std::size_t> binary_stl_triangles(std::string_view text) {
  std::uint32_t count = 0;
  if (text.size() < kStlHead + 4) return std::nullopt;
  std::memcpy(&count, text.data() + kStlHead, sizeof count);
  return text.size() == kStlHead + 4 + kStlTriangle * count ? std::optional<std::size_t>(count) : std::nullopt;
}

Surface read_stl(const std::string& path, std::string_view text) {
  if (const std::optional<std::size_t> count = binary_stl_triangles(text)) return read_binary_stl(text, *count);
  if (!text.starts_with("solid"))
    throw InputError(path + ": it is neither text that begins with 'solid' nor of the length that its number of " +
                     "triangles asks for");
  SharedCorners corners;
  for (const text::TextLine& line : text::split_lines(path, text))
    if (const auto words = text::split_words(line.text); !words.empty() && words[0] == "vertex")
      corners.add(numbers_behind_word(path, line, words));
  return corners.surface();
}

Surface read_obj(const std::string& path, std::string_view text) {
  Surface surface;
  std::vector<double> coordinates;
  for (const text::TextLine& line : text::split_lines(path, text)) {
    const std::vector<std::string_view> words = text::split_words(line.text);
    if (words.empty()) continue;
    if (words[0] == "v") {
      const auto place = numbers_behind_word(path, line, words);
      coordinates.insert(coordinates.end(), place.begin(), place.end());
    }
    if (words[0] != "f") continue;
    std::vector<int> corners;
    for (std::size_t i = 1; i < words.size(); ++i) {
      // vertex/texture/normal; from 1, or from the last backwards
      const std::string number(words[i].substr(0, words[i].find('/')));
      if (!text::is_number(number))
        text::fail(path, line.number, fmt::format("{} is not a vertex", text::in_quotes(words[i])));
      const double corner = std::strtod(number.c_str(), nullptr), count = static_cast<double>(coordinates.size()) / 3;
      const double index = corner < 0 ? count + corner : corner - 1;
      corners.push_back(index >= 0 && index < count ? static_cast<int>(index) : -1);
    }
    add_polygon(surface, corners);
  }
  surface.vertices.points = text::points_from(coordinates, 3);
  return surface;
}

}  // namespace pulson::formats
