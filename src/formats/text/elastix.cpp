// The input points of elastix and transformix: `point` or `index`, their number, and a line for each.
// The outputpoints.txt of transformix: a line for each point, `Point 0 ; InputIndex = [ 1 2 ] ; InputPoint = [ .. ]`
// and so on to `OutputPoint = [ .. ] ; Deformation = [ .. ]`.

#include <algorithm>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "text_lines.hpp"

namespace pulson::io {
namespace {

bool is_kind(std::string_view line) {
  const std::string kind = to_lower(line);
  return kind == "point" || kind == "index";
}

}  // namespace

bool sniff_elastix(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 2);
  return lines.size() == 2 && is_kind(lines[0]) && parse_count(lines[1]);
}

LandmarkFile read_elastix(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const TextLine kind = lines.take("point or index");
  if (!is_kind(kind.text)) fail(path, kind.number, in_quotes(kind.text) + " where point or index is expected");
  const TextLine announcement = lines.take("the number of points");
  const std::size_t count = require_count(path, announcement, announcement.text, "the number of points");
  LandmarkFile file;
  file.shapes.emplace_back().points = take_points(lines, count, PointList(dimension_of_next(lines)));
  lines.require_end(counted(count, "point"));
  if (to_lower(kind.text) == "index") {
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
  WrittenLandmarks written{fmt::format("point\n{}\n", shape.count()), losses_of(target, file, {})};
  append_points(written.text, shape.points, "");
  return written;
}

namespace {

/// The words between the brackets of the field `name`, among fields between semicolons.
std::vector<std::string_view> field(const std::string& path, const TextLine& line, std::string_view name) {
  std::string_view rest = line.text;
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || to_lower(trim(part.substr(0, equals))) != to_lower(name)) continue;
    const std::string_view value = trim(part.substr(equals + 1));
    if (!value.starts_with('[') || !value.ends_with(']'))
      fail(path, line.number, fmt::format("{} is {}; numbers in brackets are expected", name, in_quotes(value)));
    return split_words(value.substr(1, value.size() - 2));
  }
  fail(path, line.number, fmt::format("no {} = [ .. ] in {}", name, in_quotes(line.text)));
}

}  // namespace

bool sniff_transformix(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  if (lines.empty()) return false;
  const std::string line = to_lower(lines.front());
  return line.starts_with("point") && line.find(';') != std::string::npos &&
         line.find("outputpoint") != std::string::npos;
}

LandmarkFile read_transformix(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const std::size_t d = field(path, lines.peek(), "InputPoint").size();
  if (d != 2 && d != 3)
    fail(path, lines.peek().number, fmt::format("InputPoint has {}; 2 or 3 are expected", counted(d, "coordinate")));
  PointList input(d);
  PointList output(d);
  for (std::size_t i = 1; !lines.at_end(); ++i) {
    const TextLine line = lines.take("a point");
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

}  // namespace pulson::io
