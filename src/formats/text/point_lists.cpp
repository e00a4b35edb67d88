// The .pts files of IDAV Landmark: `Version 1.0`, a count, and lines `S000 x y z` that begin with the code of the
// landmark: S for single points, C for those of curves, P for those of patches.

// The .pts files of the iBUG face data: `version: 1`, `n_points: N` and the points between braces.

// The input points of elastix and transformix: `point` or `index`, their number, and a line for each.
// The outputpoints.txt of transformix: a line for each point, `Point 0 ; InputIndex = [ 1 2 ] ; InputPoint = [ .. ]`
// and so on to `OutputPoint = [ .. ] ; Deformation = [ .. ]`.

#include <algorithm>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "text_lines.hpp"

namespace pulson::formats {

namespace {

constexpr double kIdavMissing = 9999;

bool is_version(std::string_view line) {
  const std::vector<std::string_view> words = text::split_words(line);
  return words.size() == 2 && text::to_lower(words[0]) == "version" && text::is_number(words[1]);
}

bool sniff_idav(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 2);
  return lines.size() == 2 && is_version(lines[0]) && parse_count(lines[1]);
}

LandmarkFile read_idav(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const text::TextLine version = lines.take("Version 1.0");
  if (!is_version(version.text))
    text::fail(path, version.number, text::in_quotes(version.text) + " where Version 1.0 is expected");
  const text::TextLine announcement = lines.take("the number of landmarks");
  const std::size_t count = require_count(path, announcement, announcement.text, "the number of landmarks");
  PointList list(dimension_of_next(lines, 1), kIdavMissing);
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  for (std::size_t i = 1; i <= count; ++i) {
    const text::TextLine line = lines.take(fmt::format("landmark {} of {}", i, count));
    const std::vector<std::string_view> words = text::split_words(line.text);
    list.add(std::span(words).subspan(1), {path, line.number, text::in_quotes(words.front()), "", 0});
    shape.labels.emplace_back(words.front());
  }
  lines.require_end(text::counted(count, "landmark"));
  shape.points = list.points();
  return file;
}

/// What follows `key:`, where `line` is of this key.
std::optional<std::string_view> value_of(std::string_view line, std::string_view key) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || text::to_lower(text::trim(line.substr(0, colon))) != key) return std::nullopt;
  return text::trim(line.substr(colon + 1));
}

std::size_t take_point_count(TextLines& lines) {
  text::TextLine line = lines.take("version: or n_points:");
  if (const auto version = value_of(line.text, "version")) {
    if (*version != "1" && *version != "1.0")
      text::fail(lines.path(), line.number,
                 fmt::format("version {} of the format; 1 is read", text::in_quotes(*version)));
    line = lines.take("n_points:");
  }
  const auto count = value_of(line.text, "n_points");
  if (!count) text::fail(lines.path(), line.number, text::in_quotes(line.text) + " where n_points: is expected");
  return require_count(lines.path(), line, *count, "the number of points");
}

void take_brace(TextLines& lines, std::string_view brace) {
  const text::TextLine line = lines.take(text::in_quotes(brace));
  if (line.text != brace)
    text::fail(lines.path(), line.number,
               fmt::format("{} where {} is expected", text::in_quotes(line.text), text::in_quotes(brace)));
}

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
  lines.require_end(text::counted(count, "point"));
  return file;
}

WrittenLandmarks write_ibug(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "ibug"};
  const Landmarks& shape = require_one_shape(target, file);
  require_landmarks(target, shape);
  require_plane_or_space(target, shape);
  WrittenLandmarks written{fmt::format("version: 1\nn_points: {}\n{{\n", shape.count()),
                           losses_of(target, file, {.directions = true})};
  append_points(written.text, shape.points, "nan");
  written.text += "}\n";
  return written;
}

bool is_kind(std::string_view line) {
  const std::string kind = text::to_lower(line);
  return kind == "point" || kind == "index";
}

bool sniff_elastix(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 2);
  return lines.size() == 2 && is_kind(lines[0]) && parse_count(lines[1]);
}

LandmarkFile read_elastix(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const text::TextLine kind = lines.take("point or index");
  if (!is_kind(kind.text))
    text::fail(path, kind.number, text::in_quotes(kind.text) + " where point or index is expected");
  const text::TextLine announcement = lines.take("the number of points");
  const std::size_t count = require_count(path, announcement, announcement.text, "the number of points");
  LandmarkFile file;
  file.shapes.emplace_back().points = take_points(lines, count, PointList(dimension_of_next(lines)));
  lines.require_end(text::counted(count, "point"));
  if (text::to_lower(kind.text) == "index") {
    file.units = "voxels";
    file.warnings.push_back(path + ": the points are indices of voxels, not positions; they are not converted");
  }
  return file;
}

WrittenLandmarks write_elastix(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "elastix"};
  const Landmarks& shape = require_one_shape(target, file);
  require_landmarks(target, shape);
  require_plane_or_space(target, shape);
  require_complete(target, shape);
  WrittenLandmarks written{fmt::format("point\n{}\n", shape.count()), losses_of(target, file, {.directions = true})};
  append_points(written.text, shape.points, "");
  return written;
}

/// The words between the brackets of the field `name`, among fields between semicolons.
std::vector<std::string_view> field(const std::string& path, const text::TextLine& line, std::string_view name) {
  std::string_view rest = line.text;
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || text::to_lower(text::trim(part.substr(0, equals))) != text::to_lower(name))
      continue;
    const std::string_view value = text::trim(part.substr(equals + 1));
    if (!value.starts_with('[') || !value.ends_with(']'))
      text::fail(path, line.number,
                 fmt::format("{} is {}; numbers in brackets are expected", name, text::in_quotes(value)));
    return text::split_words(value.substr(1, value.size() - 2));
  }
  text::fail(path, line.number, fmt::format("no {} = [ .. ] in {}", name, text::in_quotes(line.text)));
}

bool sniff_transformix(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  if (lines.empty()) return false;
  const std::string line = text::to_lower(lines.front());
  return line.starts_with("point") && line.find(';') != std::string::npos &&
         line.find("outputpoint") != std::string::npos;
}

LandmarkFile read_transformix(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const std::size_t d = field(path, lines.peek(), "InputPoint").size();
  if (d != 2 && d != 3)
    text::fail(path, lines.peek().number,
               fmt::format("InputPoint has {}; 2 or 3 are expected", text::counted(d, "coordinate")));
  PointList input(d);
  PointList output(d);
  for (std::size_t i = 1; !lines.at_end(); ++i) {
    const text::TextLine line = lines.take("a point");
    const std::string number = std::to_string(i);
    input.add(field(path, line, "InputPoint"), {path, line.number, number, "InputPoint", 0});
    output.add(field(path, line, "OutputPoint"), {path, line.number, number, "OutputPoint", 0});
  }
  LandmarkFile file;
  file.shapes.resize(2);
  file.shapes[0].name = "input";
  file.shapes[0].points = input.points();
  file.shapes[1].name = "output";
  file.shapes[1].points = output.points();
  return file;
}

}  // namespace

LandmarkFormat ibug_format() {
  return {.name = "ibug",
          .extensions = {"pts"},
          .help = "points of iBUG face data: version:, n_points:, coordinates between braces",
          .sniff = sniff_ibug,
          .read = read_ibug,
          .write = write_ibug,
          .y_down = true};
}

LandmarkFormat elastix_format() {
  return {.name = "elastix",
          .extensions = {"txt", "pts"},
          .help = "input points of elastix and transformix: point or index, their number, coordinates",
          .sniff = sniff_elastix,
          .read = read_elastix,
          .write = write_elastix,
          .y_down = true};
}

LandmarkFormat transformix_format() {
  return {.name = "transformix",
          .extensions = {"txt"},
          .help = "outputpoints.txt of transformix; two shapes, input and output",
          .sniff = sniff_transformix,
          .read = read_transformix,
          .y_down = true};
}

LandmarkFormat idav_format() {
  return {.name = "idav",
          .extensions = {"pts"},
          .help = "points of IDAV Landmark: Version 1.0, their number, lines S000 x y z",
          .sniff = sniff_idav,
          .read = read_idav};
}

}  // namespace pulson::formats
