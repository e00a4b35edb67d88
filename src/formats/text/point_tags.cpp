// Points of Fiji's plugin Name Landmarks and Register, in XML (.points): <namedpointset> with <pointworld name x y z>,
// of which set="false" marks a missing one.

// Picked points of MeshLab in XML (.pp): <PickedPoints> with <point name x y z active>, of which active="0" marks a
// missing one.

#include <optional>
#include <string>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "xml_tags.hpp"

namespace pulson::formats {
namespace {

/// A format whose file holds an element for each landmark.
struct PointElement {
  const char* file;     ///< the outermost element
  const char* element;  ///< of a point, with the attributes name, x, y, z
  const char* key;      ///< the attribute that marks a missing one
  const char* missing;  ///< and its value there
};

constexpr PointElement kFiji = {"namedpointset", "pointworld", "set", "false"};
constexpr PointElement kMeshLab = {"PickedPoints", "point", "active", "0"};

LandmarkFile read_points(const std::string& path, std::string_view text, const PointElement& kind) {
  Tags tags(path, text);
  GatheredPoints points(3);
  while (const std::optional<Tag> tag = tags.take()) {
    if (!tag->begins || tag->name != kind.element) continue;
    const std::string name = tag->attribute("name");
    if (tag->attribute(kind.key) == kind.missing) {
      points.add_missing(name);
      continue;
    }
    text::CoordinatePlace place{path, tag->line,
                                name.empty() ? std::to_string(points.count() + 1) : text::in_quotes(name), "", 0};
    Eigen::Vector3d point;
    for (; place.axis < 3; ++place.axis) point[static_cast<Eigen::Index>(place.axis)] = coordinate_of(*tag, place);
    points.add(point, name);
  }
  if (points.count() == 0) text::fail(path, tags.line(), fmt::format("there is no <{}> in this file", kind.element));
  LandmarkFile file;
  points.move_to(file.shapes.emplace_back());
  drop_repeated_labels(path, file);
  return file;
}

}  // namespace

LandmarkFormat fiji_format() {
  return {
      .name = "fiji",
      .extensions = {"points"},
      .help = "points of Fiji's Name Landmarks and Register: <pointworld> with name, x, y, z; set=\"false\" is missing",
      .sniff = [](std::string_view text) { return is_xml_of(text, kFiji.file); },
      .read = [](const std::string& path, std::string_view text) { return read_points(path, text, kFiji); }};
}

LandmarkFormat meshlab_format() {
  return {.name = "meshlab",
          .extensions = {"pp"},
          .help = "picked points of MeshLab: <point> with name, x, y, z; active=\"0\" is missing",
          .sniff = [](std::string_view text) { return is_xml_of(text, kMeshLab.file); },
          .read = [](const std::string& path, std::string_view text) { return read_points(path, text, kMeshLab); }};
}

}  // namespace pulson::formats
