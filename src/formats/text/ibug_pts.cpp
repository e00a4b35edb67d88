// The .pts files of the iBUG face data: `version: 1`, `n_points: N` and the points between braces.

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "text_lines.hpp"

namespace pulson::io {
namespace {

/// What follows `key:`, where `line` is of this key.
std::optional<std::string_view> value_of(std::string_view line, std::string_view key) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || to_lower(trim(line.substr(0, colon))) != key) return std::nullopt;
  return trim(line.substr(colon + 1));
}

std::size_t take_point_count(TextLines& lines) {
  TextLine line = lines.take("version: or n_points:");
  if (const auto version = value_of(line.text, "version")) {
    if (*version != "1" && *version != "1.0")
      fail(lines.path(), line.number, fmt::format("version {} of the format; 1 is read", in_quotes(*version)));
    line = lines.take("n_points:");
  }
  const auto count = value_of(line.text, "n_points");
  if (!count) fail(lines.path(), line.number, in_quotes(line.text) + " where n_points: is expected");
  return require_count(lines.path(), line, *count, "the number of points");
}

void take_brace(TextLines& lines, std::string_view brace) {
  const TextLine line = lines.take(in_quotes(brace));
  if (line.text != brace)
    fail(lines.path(), line.number, fmt::format("{} where {} is expected", in_quotes(line.text), in_quotes(brace)));
}

}  // namespace

bool sniff_ibug(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 2);
  if (lines.size() < 2) return false;
  return value_of(lines[0], "n_points") || (value_of(lines[0], "version") && value_of(lines[1], "n_points"));
}

LandmarkFile read_ibug(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const std::size_t count = take_point_count(lines);
  take_brace(lines, "{");
  LandmarkFile file;
  file.shapes.emplace_back().points = take_points(lines, count, PointList(dimension_of_next(lines)));
  take_brace(lines, "}");
  lines.require_end(counted(count, "point"));
  return file;
}

WrittenLandmarks write_ibug(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "ibug"};
  const Landmarks& shape = require_one_shape(target, file);
  require_landmarks(target, shape);
  require_plane_or_space(target, shape);
  WrittenLandmarks written{fmt::format("version: 1\nn_points: {}\n{{\n", shape.count()), losses_of(target, file, {})};
  append_points(written.text, shape.points, "nan");
  written.text += "}\n";
  return written;
}

}  // namespace pulson::io
