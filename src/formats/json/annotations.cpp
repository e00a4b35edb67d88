// Annotations of LabelMe, the drawing program, in JSON: those of one image, in a list `shapes`. Its points are the
// landmarks of one shape, its lines are curves and its polygons outlines, which are the landmarks where it has no
// points.

// Landmarks of menpo in JSON (.ljson): groups of points, each a shape, in rows and columns of an image, y downwards.
// Version 3 has an object `groups`, version 2 one group at the top. Labels name parts of a shape by their points.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/shape_options.hpp"
#include "json_reader.hpp"

namespace pulson::formats {

namespace {

/// One pass over the annotations of a file.
class LabelmeReader {
 public:
  LabelmeReader(const std::string& path, const JsonValue& json) : path_(path), json_(json) {}

  LandmarkFile read() {
    shape_.image = text_of(json_, "imagePath");
    if (json_.has("imageWidth")) shape_.frame.width = json_.at("imageWidth").count();
    if (json_.has("imageHeight")) shape_.frame.height = json_.at("imageHeight").count();
    for (const JsonValue& annotation : json_.at("shapes").items()) read_annotation(annotation);
    shape_.points = text::points_from(coordinates_, 2);
    shape_.labels = text::unless_all_empty(std::move(labels_));
    const bool all_have_groups = std::find(groups_.begin(), groups_.end(), "") == groups_.end();
    const bool some_have_groups = !text::unless_all_empty(groups_).empty();
    if (some_have_groups && !all_have_groups) warn("a group_id that not all points have is not used");
    if (all_have_groups) shape_.groups = std::move(groups_);
    if (take_lines_as_landmarks(shape_)) {
      warn(taken_as_landmarks(1));
      link_neighbours();
    }
    file_.shapes.push_back(std::move(shape_));
    return std::move(file_);
  }

 private:
  /// Joins landmarks along the lines that they are from.
  void link_neighbours() {
    for (const std::vector<int>& line : landmarks_by_group(shape_)) {
      for (std::size_t i = 1; i < line.size(); ++i) shape_.links.emplace_back(line[i - 1], line[i]);
      const bool is_closed = shape_.groups[static_cast<std::size_t>(line.front())].starts_with("outline ");
      if (is_closed && line.size() > 2) shape_.links.emplace_back(line.back(), line.front());
    }
  }

  void warn(const std::string& text) { file_.warnings.push_back(fmt::format("{}: {}", path_, text)); }

  void read_annotation(const JsonValue& annotation) {
    if (!annotation.value().is_object()) annotation.fail("is not an object");
    const std::string kind = annotation.has("shape_type") ? annotation.at("shape_type").text() : "polygon";
    const std::string label = text_of(annotation, "label");
    const Points points = annotation.at("points").points();
    if (points.rows() != 2) annotation.at("points").fail("is not a list of points [x, y]");
    if (points.cols() == 1) {
      coordinates_.insert(coordinates_.end(), {points(0, 0), points(1, 0)});
      labels_.push_back(label);
      groups_.push_back(text_of(annotation, "group_id"));
    } else if (points.cols() > 1 && (kind == "line" || kind == "linestrip")) {
      shape_.curves.push_back(points);
    } else if (points.cols() > 1 && kind == "polygon") {
      shape_.outlines.push_back(points);
    } else {
      warn(fmt::format("the {} {} of LabelMe is not used", text::in_quotes(kind), text::in_quotes(label)));
    }
  }

  const std::string& path_;
  const JsonValue& json_;
  LandmarkFile file_;
  Landmarks shape_;
  std::vector<double> coordinates_;
  std::vector<std::string> labels_;
  std::vector<std::string> groups_;
};

/// The key imagePath, or shape_type in one of `shapes`.
bool sniff_labelme(std::string_view text) {
  const JsonKeys keys(text);
  return !keys.is_list() && (keys.has(1, "imagePath") || keys.has(3, "shape_type"));
}

LandmarkFile read_labelme(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  return LabelmeReader(path, json).read();
}

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
  if (group.at("landmarks").has("connectivity"))
    shape.links = group.at("landmarks").at("connectivity").links(shape.count(), 0);
  return shape;
}

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

}  // namespace

LandmarkFormat labelme_format() {
  return {.name = "labelme",
          .extensions = {},
          .help =
              "annotations of LabelMe: the points of an image as one shape with labels, group_id as groups, lines as "
              "curves, "
              "polygons as outlines",
          .sniff = sniff_labelme,
          .read = read_labelme,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

LandmarkFormat menpo_format() {
  return {
      .name = "menpo",
      .extensions = {"ljson"},
      .help = "landmarks of menpo: each of `groups` is a shape, points are row, column of an image, labels are groups",
      .sniff = sniff_menpo,
      .read = read_menpo,
      .y_down = true};
}

}  // namespace pulson::formats
