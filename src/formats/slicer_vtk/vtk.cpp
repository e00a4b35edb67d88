// VTK legacy polydata. Landmarks are the points in the order of the file; outlines are the pieces that lines and
// polygons join.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "vtk_numbers.hpp"

namespace pulson::formats {

namespace {

/// One pass over the sections of a file.
class VtkReader {
 public:
  VtkReader(const std::string& path, std::string_view text) : cursor_(path, text) {}

  LandmarkFile read() {
    axes_ = take_vtk_header(cursor_);
    while (!at_attributes_ && read_section()) {
    }
    if (!has_points_) throw InputError(cursor_.path() + " has no section POINTS");
    for (const VtkCells& cells : sections_) check_vtk_points(cursor_, cells, count());
    LandmarkFile file;
    file.axes = axes_;
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = landmarks(file.warnings);
    shape.groups = groups(file.warnings);
    for (const VtkCells& cells : sections_)
      if (cells.are_lines())
        cells.visit_edges([&](std::size_t a, std::size_t b) {
          if (a != b) shape.links.emplace_back(static_cast<int>(a), static_cast<int>(b));
        });
    return file;
  }

 private:
  std::size_t count() const { return static_cast<std::size_t>(points_.cols()); }

  /// @return false at the end
  bool read_section() {
    const std::string_view word = cursor_.take_word();
    const std::string keyword = text::to_lower(word);
    if (keyword.empty()) return false;
    if (keyword == "points")
      read_points(word);
    else if (keyword == "vertices" || keyword == "lines" || keyword == "polygons" || keyword == "triangle_strips")
      sections_.push_back(take_vtk_cells(cursor_, word));
    else if (keyword == "field")
      skip_vtk_field(cursor_);
    else if (keyword == "metadata")
      skip_vtk_metadata(cursor_);
    else if (keyword == "point_data" || keyword == "cell_data")
      at_attributes_ = true;  // they end the file
    else
      cursor_.fail_here(text::in_quotes(word) +
                        " where a section is expected: POINTS, VERTICES, LINES, POLYGONS, TRIANGLE_STRIPS, FIELD, "
                        "METADATA, POINT_DATA or CELL_DATA");
    return true;
  }

  void read_points(std::string_view keyword) {
    if (has_points_) cursor_.fail_here("a second section POINTS");
    has_points_ = true;
    VtkBlock block{cursor_.place(), ""};
    const std::size_t count = take_vtk_count(cursor_, keyword);
    const VtkType& type = take_vtk_type(cursor_, keyword);
    block.text = fmt::format("{} {} {}", keyword, count, type.name);
    begin_vtk_numbers(cursor_, block, type, count, 3);
    points_.resize(3, static_cast<Eigen::Index>(count));
    text::CoordinatePlace place{cursor_.path(), 0, "", text::in_quotes(block.text), 0};
    for (std::size_t i = 0; i < 3 * count; ++i) {
      place.axis = i % 3;
      if (place.axis == 0) place.landmark = std::to_string(i / 3 + 1);
      points_(static_cast<Eigen::Index>(place.axis), static_cast<Eigen::Index>(i / 3)) =
          cursor_.is_binary ? binary_coordinate(type, place)
                            : text_coordinate(take_vtk_number(cursor_, block, 3 * count, i), place);
    }
  }

  double text_coordinate(std::string_view word, text::CoordinatePlace& place) const {
    place.line = cursor_.place().line;
    return text::parse_coordinate(word, place);
  }

  double binary_coordinate(const VtkType& type, const text::CoordinatePlace& place) {
    const VtkPlace here = cursor_.here();
    const double value = type.number(cursor_.take_bytes(type.size));
    if (std::isinf(value))
      cursor_.fail_at(here, fmt::format("landmark {} of {}: {} is '{}'; a coordinate must be finite", place.landmark,
                                        place.shape, "xyz"[place.axis], value));
    return value;
  }

  /// In the plane where all z are equal.
  Points landmarks(std::vector<std::string>& warnings) const {
    const auto [low, high] = bounding_box(points_);
    if (low[2] != high[2] || count() == 0) return points_;
    if (low[2] != 0)
      warnings.push_back(fmt::format("{}: all z are {}; the shape is read in the plane", cursor_.path(), low[2]));
    return points_.topRows(2);
  }

  /// None where lines and polygons leave the points one set.
  std::vector<std::string> groups(std::vector<std::string>& warnings) const {
    const std::vector<std::size_t> pieces = vtk_pieces(sections_, count());
    if (!vtk_lines_follow_points(sections_, pieces))
      warnings.push_back(cursor_.path() +
                         ": the lines connect the points in a different order from that of the file, which is kept");
    std::vector<std::string> names;
    if (std::adjacent_find(pieces.begin(), pieces.end(), std::not_equal_to<>()) == pieces.end()) return names;
    names.reserve(pieces.size());
    for (const std::size_t piece : pieces) names.push_back(std::to_string(piece));
    return names;
  }

  VtkCursor cursor_;
  std::string axes_;
  bool has_points_ = false;
  bool at_attributes_ = false;
  Points points_;
  std::vector<VtkCells> sections_;
};

bool sniff_vtk(std::string_view text) { return text::without_byte_order_mark(text).starts_with(kVtkMagic); }

LandmarkFile read_vtk(const std::string& path, std::string_view text) { return VtkReader(path, text).read(); }

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

/// Whether the lines pass along all links of the shape.
bool draws_links(const Joined& joined, const Landmarks& shape) {
  std::set<std::pair<int, int>> drawn;
  for (const std::vector<int>& line : joined.lines)
    for (std::size_t i = 1; i < line.size(); ++i) drawn.insert(std::minmax({line[i - 1], line[i]}));
  return std::all_of(shape.links.begin(), shape.links.end(), [&](const auto& link) {
    return drawn.contains(std::minmax({link.first, link.second}));
  });
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
  written.losses = losses_of(target, file, {.groups = true, .links = draws_links(joined, shape), .axes = knows_axes});
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

}  // namespace

LandmarkFormat vtk_format() {
  return {.name = "vtk",
          .extensions = {"vtk"},
          .help =
              "VTK legacy polydata, 1.0 to 5.1, ASCII or BINARY: POINTS; in the plane where all z are equal; pieces of "
              "LINES "
              "and POLYGONS are groups",
          .sniff = sniff_vtk,
          .read = read_vtk,
          .write = write_vtk,
          .holds_bytes = true};
}

}  // namespace pulson::formats
