// The input points of elastix and transformix: `point` or `index`, their number, and a line for each.

#include <fmt/format.h>

#include "formats.hpp"
#include "landmark_writers.hpp"
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

}  // namespace pulson::io
