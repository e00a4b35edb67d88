// The .pts files of IDAV Landmark: `Version 1.0`, a count, and lines `S000 x y z` that begin with the code of the
// landmark: S for single points, C for those of curves, P for those of patches.

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::io {
namespace {

constexpr double kIdavMissing = 9999;

bool is_version(std::string_view line) {
  const std::vector<std::string_view> words = split_words(line);
  return words.size() == 2 && to_lower(words[0]) == "version" && is_number(words[1]);
}

}  // namespace

bool sniff_idav(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 2);
  return lines.size() == 2 && is_version(lines[0]) && parse_count(lines[1]);
}

LandmarkFile read_idav(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const TextLine version = lines.take("Version 1.0");
  if (!is_version(version.text)) fail(path, version.number, in_quotes(version.text) + " where Version 1.0 is expected");
  const TextLine announcement = lines.take("the number of landmarks");
  const std::size_t count = require_count(path, announcement, announcement.text, "the number of landmarks");
  PointList list(dimension_of_next(lines, 1), kIdavMissing);
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  for (std::size_t i = 1; i <= count; ++i) {
    const TextLine line = lines.take(fmt::format("landmark {} of {}", i, count));
    const std::vector<std::string_view> words = split_words(line.text);
    list.add(std::span(words).subspan(1), {path, line.number, in_quotes(words.front()), "", 0});
    shape.labels.emplace_back(words.front());
  }
  lines.require_end(counted(count, "landmark"));
  shape.points = list.points();
  return file;
}

}  // namespace pulson::io
