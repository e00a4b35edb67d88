// Landmarks of menpo in JSON (.ljson): groups of points, each a shape, in rows and columns of an image, y downwards.
// Version 3 has an object `groups`, version 2 one group at the top. Labels name parts of a shape by their points.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "json_reader.hpp"

namespace pulson::io {
namespace {

/// The label of each point; none where a point has none or more than one.
std::vector<std::string> read_parts(const JsonValue& group, int count) {
  std::vector<std::string> parts(static_cast<std::size_t>(count));
  if (!group.has("labels")) return {};
  for (const JsonValue& label : group.at("labels").items()) {
    const std::string name = label.at("label").text();
    for (const JsonValue& index : label.at("mask").items()) {
      const double number = index.number();
      if (!(number >= 0 && number < count) || number != std::floor(number)) index.fail("is not the number of a point");
      std::string& part = parts[static_cast<std::size_t>(number)];
      if (!part.empty()) return {};
      part = name;
    }
  }
  const bool all_have_one = std::find(parts.begin(), parts.end(), "") == parts.end();
  return all_have_one ? parts : std::vector<std::string>{};
}

Landmarks read_group(const JsonValue& group, const std::string& name) {
  Landmarks shape;
  shape.name = name;
  shape.points = group.at("landmarks").at("points").points();
  if (shape.points.rows() >= 2) shape.points.row(0).swap(shape.points.row(1));
  shape.groups = read_parts(group, shape.count());
  return shape;
}

}  // namespace

/// The keys `landmarks` and `points`, and `groups` or `labels`, without the `shapes` of other layouts.
bool sniff_menpo(std::string_view text) {
  const auto has = [&](std::string_view key) { return text.find(key) != std::string_view::npos; };
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n\xEF\xBB\xBF"), text.size()));
  return text.starts_with('{') && has("\"landmarks\"") && has("\"points\"") && has("\"labels\"") &&
         has("\"version\"") && !has("\"shapes\"");
}

LandmarkFile read_menpo(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  LandmarkFile file;
  if (!json.has("groups")) {
    file.shapes.push_back(read_group(json, ""));
    return file;
  }
  const JsonValue groups = json.at("groups");
  if (!groups.value().is_object()) groups.fail("is not an object of groups of landmarks");
  for (const auto& [name, group] : groups.value().items()) file.shapes.push_back(read_group(groups.at(name), name));
  if (file.shapes.empty()) groups.fail("is empty; a group of landmarks is needed");
  return file;
}

}  // namespace pulson::io
