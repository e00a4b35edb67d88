#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"

namespace pulson::io {
namespace {

using Cells = std::vector<std::vector<int>>;

/// Lines through the landmarks of each group, and the landmarks of none.
struct Joined {
  Cells lines;
  std::vector<int> alone;
  std::string_view lost{};  ///< what reading does not find again of the groups
};

/// Reading numbers the lines from 1 and gives 0 to points of none: groups with such names get their lines so. A single
/// line through all is not read as a group.
Joined join_groups(const Landmarks& shape) {
  const Cells groups = landmarks_by_group(shape);
  if (groups.empty()) return {};
  if (shape.groups.empty()) return {{}, groups.front()};
  std::map<std::string, std::vector<int>> by_name;
  for (const auto& group : groups) by_name[shape.groups[static_cast<std::size_t>(group.front())]] = group;
  Joined joined;
  const bool has_alone = by_name.count("0") > 0;
  for (std::size_t piece = 1; piece <= groups.size() - (has_alone ? 1 : 0); ++piece) {
    const auto found = by_name.find(std::to_string(piece));
    if (found == by_name.end()) return {groups, {}, "names of groups but 1, 2, ..."};
    joined.lines.push_back(found->second);
  }
  if (has_alone) joined.alone = by_name["0"];
  if (groups.size() == 1) joined.lost = "a single group";
  return joined;
}

void append_cells(std::string& text, std::string_view keyword, const Cells& cells) {
  std::size_t size = cells.size();
  for (const auto& cell : cells) size += cell.size();
  fmt::format_to(std::back_inserter(text), "{} {} {}\n", keyword, cells.size(), size);
  for (const auto& cell : cells) fmt::format_to(std::back_inserter(text), "{} {}\n", cell.size(), fmt::join(cell, " "));
}

Cells each_alone(const std::vector<int>& points) {
  Cells cells;
  cells.reserve(points.size());
  for (const int point : points) cells.push_back({point});
  return cells;
}

/// The second line of a file, which readers cut at 256 bytes: the name, and the axes in the words of 3D Slicer.
std::string title(std::string name, const std::string& axes) {
  constexpr std::size_t kLongest = 200;
  constexpr std::string_view kSpaceField = "SPACE=";
  for (char& c : name)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  for (std::size_t at = name.find(kSpaceField); at != std::string::npos; at = name.find(kSpaceField, at))
    name[at + kSpaceField.size() - 1] = ' ';
  std::string line = name.empty() ? "landmarks" : name.substr(0, kLongest);
  return axes.empty() ? line : fmt::format("{} {}{}", line, kSpaceField, axes);
}

}  // namespace

WrittenLandmarks write_vtk(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "vtk"};
  const Landmarks& shape = require_one_shape(target, file);
  require_landmarks(target, shape);
  require_complete(target, shape);
  WrittenLandmarks written;
  std::vector<std::string> plane_losses;  // none: a shape with z = 0 is read back in the plane
  const Points points = points_in_space(target, shape, plane_losses);
  const Joined joined = join_groups(shape);
  const bool knows_axes = file.axes == "LPS" || file.axes == "RAS";
  written.losses = losses_of(target, file, {.groups = true, .axes = knows_axes});
  if (!joined.lost.empty()) written.losses.push_back(cannot_hold(target, joined.lost));
  const auto [low, high] = bounding_box(points);
  if (shape.dimension() == 3 && low[2] == high[2])
    written.losses.push_back(fmt::format("{}: all z are {}; the shape is read back in the plane", path, low[2]));
  written.text = fmt::format("# vtk DataFile Version 3.0\n{}\nASCII\nDATASET POLYDATA\nPOINTS {} double\n",
                             title(shape.name, knows_axes ? file.axes : ""), points.cols());
  for (const auto& point : points.colwise())
    fmt::format_to(std::back_inserter(written.text), "{} {} {}\n", point[0], point[1], point[2]);
  if (!joined.alone.empty()) append_cells(written.text, "VERTICES", each_alone(joined.alone));
  if (!joined.lines.empty()) append_cells(written.text, "LINES", joined.lines);
  return written;
}

}  // namespace pulson::io
