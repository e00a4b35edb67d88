// Annotations of the VGG Image Annotator (VIA), version 1 and 2, in JSON, as a project too, or as a table: regions of
// images. Those of one image are a shape: its points are the landmarks, its polylines curves, its polygons outlines.
// See https://www.robots.ox.ac.uk/~vgg/software/via/docs/face_track_annotation.html#data-formats.

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/formats.hpp"
#include "json_reader.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

/// The attribute that names a landmark: one of these names, else the only one.
std::string label_of(const JsonValue& attributes) {
  constexpr std::array<const char*, 8> kNames = {"landmark", "lm", "keypoint", "point", "label", "name", "id", "part"};
  for (const char* const name : kNames)
    for (const auto& [key, value] : attributes.value().items())
      if (text::to_lower(key) == name && (value.is_string() || value.is_number())) return text_of(attributes, key);
  if (attributes.value().size() != 1) return {};
  const auto only = attributes.value().begin();
  if (only.value().is_string() || only.value().is_number()) return text_of(attributes, only.key());
  // boxes that are ticked: {"wing": true}
  return only.value().is_object() && only.value().size() == 1 ? only.value().begin().key() : std::string();
}

/// Gathers the regions of images.
class ViaShapes {
 public:
  explicit ViaShapes(const std::string& path) : path_(path) {}

  void add(const std::string& image, const JsonValue& shape, const JsonValue& attributes) {
    if (!shape.value().is_object()) shape.fail("is not an object");
    if (shape.value().empty()) return;
    const auto [entry, is_new] = place_.try_emplace(image, file_.shapes.size());
    if (is_new) {
      file_.shapes.emplace_back().image = image;
      points_.emplace_back();
    }
    const std::string kind = shape.at("name").text();
    const std::string label = label_of(attributes);
    if (kind == "point")
      points_[entry->second].add(Eigen::Vector2d(shape.at("cx").number(), shape.at("cy").number()), label);
    else if (kind == "polyline")
      file_.shapes[entry->second].curves.push_back(line_of(shape));
    else if (kind == "polygon")
      file_.shapes[entry->second].outlines.push_back(without_closing_point(line_of(shape)));
    else
      ++unused_[kind];
  }

  LandmarkFile finish() {
    for (std::size_t i = 0; i < points_.size(); ++i) points_[i].move_to(file_.shapes[i]);
    std::erase_if(file_.shapes, [](const Landmarks& shape) {
      return shape.count() == 0 && shape.curves.empty() && shape.outlines.empty();
    });
    if (file_.shapes.empty()) throw InputError(path_ + " holds no regions that are points, polylines or polygons");
    take_lines_where_alone(path_, file_);
    drop_repeated_labels(path_, file_);
    name_by_images(file_.shapes);
    for (const auto& [kind, count] : unused_)
      file_.warnings.push_back(fmt::format("{}: {} not used; points, polylines and polygons are", path_,
                                           text::counted(count, "region " + text::in_quotes(kind))));
    return std::move(file_);
  }

 private:
  static Points line_of(const JsonValue& shape) {
    const Eigen::VectorXd x = shape.at("all_points_x").numbers();
    const Eigen::VectorXd y = shape.at("all_points_y").numbers();
    if (x.size() != y.size())
      shape.fail(fmt::format("has {} in all_points_x and {} in all_points_y", x.size(), y.size()));
    Points line(2, x.size());
    line << x.transpose(), y.transpose();
    return line;
  }

  const std::string& path_;
  LandmarkFile file_;
  std::vector<GatheredPoints> points_;  // of the shapes
  std::map<std::string, std::size_t> place_;
  std::map<std::string, std::size_t> unused_;
};

// ---- json

/// A list in version 2, an object by numbers in version 1.
std::vector<JsonValue> regions_of(const JsonValue& image) {
  const JsonValue regions = image.at("regions");
  if (regions.value().is_array()) return regions.items();
  if (!regions.value().is_object()) regions.fail("is neither a list nor an object of regions");
  std::vector<std::pair<std::size_t, JsonValue>> numbered;
  for (const auto& [key, value] : regions.value().items())
    numbered.emplace_back(std::strtoul(key.c_str(), nullptr, 10), regions.at(key));
  std::stable_sort(numbered.begin(), numbered.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<JsonValue> sorted;
  for (const auto& [number, region] : numbered) sorted.push_back(region);
  return sorted;
}

bool sniff_via_json(std::string_view text) {
  const JsonKeys keys(text);
  if (!keys.is_object()) return false;
  return (keys.has(2, "filename") && keys.has(2, "regions")) || keys.has(1, "_via_img_metadata");
}

LandmarkFile read_via_json(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  const JsonValue images = json.has("_via_img_metadata") ? json.at("_via_img_metadata") : json;
  if (!images.value().is_object()) images.fail("is not an object of images");
  ViaShapes shapes(path);
  const nlohmann::json none = nlohmann::json::object();
  for (const auto& [key, entry] : images.value().items()) {
    const JsonValue image = images.at(key);
    for (const JsonValue& region : regions_of(image))
      shapes.add(image.at("filename").text(), region.at("shape_attributes"),
                 region.has("region_attributes") ? region.at("region_attributes") : JsonValue(none, path));
  }
  return shapes.finish();
}

// ---- csv

constexpr std::string_view kViaHeader = "filename,file_size,file_attributes,region_count,region_id,";

/// The text without the mark of a comment that version 1 has before the header.
std::string_view without_mark(std::string_view text) {
  text = text::without_byte_order_mark(text);
  return text.starts_with('#') ? text.substr(1) : text;
}

bool sniff_via_csv(std::string_view text) { return without_mark(text).starts_with(kViaHeader); }

LandmarkFile read_via_csv(const std::string& path, std::string_view text) {
  const std::vector<CsvRecord> records = csv_records(path, without_mark(text));
  if (records.empty()) throw InputError(path + " is empty");
  const auto column_of = [&](std::string_view name) {
    const auto& names = records.front().fields;
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) text::fail(path, records.front().line, fmt::format("there is no column {}", name));
    return static_cast<std::size_t>(found - names.begin());
  };
  require_equal_lengths(path, records);
  const std::size_t image = column_of("filename");
  const std::size_t shape = column_of("region_shape_attributes");
  const std::size_t attributes = column_of("region_attributes");
  ViaShapes shapes(path);
  for (std::size_t i = 1; i < records.size(); ++i) {
    const std::string place = fmt::format("{}:{}", path, records[i].line);
    const nlohmann::json shape_json = parse_json(place, records[i].fields[shape]);
    const nlohmann::json attributes_json = parse_json(place, records[i].fields[attributes]);
    shapes.add(records[i].fields[image], JsonValue(shape_json, place), JsonValue(attributes_json, place));
  }
  return shapes.finish();
}

}  // namespace

LandmarkFormat via_json_format() {
  return {.name = "via",
          .extensions = {},
          .help =
              "annotations of the VGG Image Annotator in JSON: the points of an image as one shape with labels, "
              "polylines as curves, polygons as outlines",
          .sniff = sniff_via_json,
          .read = read_via_json,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

LandmarkFormat via_csv_format() {
  return {.name = "via.csv",
          .extensions = {},
          .help = "the same as a table",
          .sniff = sniff_via_csv,
          .read = read_via_csv,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

}  // namespace pulson::formats
