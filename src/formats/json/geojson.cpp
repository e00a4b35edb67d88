// Points in GeoJSON (RFC 7946), as QuPath exports them: Features with the geometries Point and MultiPoint, which are
// the landmarks of one shape; LineStrings are its curves, Polygons its outlines.

#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "json_reader.hpp"

namespace pulson::formats {
namespace {

/// The name of a feature or, in QuPath, of its class.
std::string name_of(const JsonValue& feature) {
  if (!feature.has("properties")) return {};
  const JsonValue properties = feature.at("properties");
  for (const char* const key : {"name", "label", "id"})
    if (properties.has(key) && !properties.at(key).value().is_structured() && !properties.at(key).value().is_boolean())
      return text_of(properties, key);
  if (!properties.has("classification")) return {};
  const JsonValue classification = properties.at("classification");
  return classification.has("name") ? text_of(classification, "name") : std::string();
}

class GeoJsonReader {
 public:
  GeoJsonReader(const std::string& path, const JsonValue& json) : path_(path), json_(json) {}

  LandmarkFile read() {
    const std::vector<JsonValue> features = features_of();
    for (const JsonValue& feature : features) multipoints_ += kind_of(feature) == "MultiPoint" ? 1 : 0;
    for (const JsonValue& feature : features) read_feature(feature);
    points_.move_to(shape_);
    file_.shapes.push_back(std::move(shape_));
    if (file_.shapes.front().count() == 0 && file_.shapes.front().curves.empty() &&
        file_.shapes.front().outlines.empty())
      json_.fail("has no points, lines or polygons");
    take_lines_where_alone(path_, file_);
    drop_repeated_labels(path_, file_);
    return std::move(file_);
  }

 private:
  std::vector<JsonValue> features_of() const {
    if (json_.value().is_array()) return json_.items();
    return json_.has("features") ? json_.at("features").items() : std::vector<JsonValue>{json_};
  }

  static std::string kind_of(const JsonValue& feature) {
    if (!feature.value().is_object()) feature.fail("is not an object");
    return feature.has("geometry") ? feature.at("geometry").at("type").text() : std::string();
  }

  void read_feature(const JsonValue& feature) {
    const std::string kind = kind_of(feature);
    if (kind.empty()) return;
    if (feature.has("properties") && feature.at("properties").has("objectType"))
      shape_.frame.y_down = shape_.frame.says_y = true;  // of QuPath
    const JsonValue coordinates = feature.at("geometry").at("coordinates");
    const std::string name = name_of(feature);
    if (kind == "Point") {
      add_point(coordinates, name, "");
    } else if (kind == "MultiPoint") {
      const std::string group = multipoints_ < 2 ? "" : name.empty() ? fmt::format("points {}", ++unnamed_) : name;
      for (const JsonValue& point : coordinates.items()) add_point(point, "", group);
    } else if (kind == "LineString") {
      shape_.curves.push_back(line_of(coordinates));
    } else if (kind == "MultiLineString") {
      for (const JsonValue& line : coordinates.items()) shape_.curves.push_back(line_of(line));
    } else if (kind == "Polygon") {
      add_rings(coordinates);
    } else if (kind == "MultiPolygon") {
      for (const JsonValue& polygon : coordinates.items()) add_rings(polygon);
    } else {
      file_.warnings.push_back(fmt::format("{}: the geometry {} is not used", path_, text::in_quotes(kind)));
    }
  }

  /// [x, y], perhaps with a height, which is left out.
  static Eigen::Vector2d place_of(const JsonValue& point) {
    const Eigen::VectorXd numbers = point.numbers();
    if (numbers.size() < 2) point.fail("is not a point [x, y]");
    return numbers.head(2);
  }

  void add_point(const JsonValue& point, const std::string& label, const std::string& group) {
    points_.add(place_of(point), label, group);
  }

  static Points line_of(const JsonValue& coordinates) {
    const std::vector<JsonValue> items = coordinates.items();
    Points line(2, std::ssize(items));
    for (std::size_t i = 0; i < items.size(); ++i) line.col(static_cast<Eigen::Index>(i)) = place_of(items[i]);
    return line;
  }

  void add_rings(const JsonValue& rings) {
    for (const JsonValue& ring : rings.items()) shape_.outlines.push_back(without_closing_point(line_of(ring)));
  }

  const std::string& path_;
  const JsonValue& json_;
  LandmarkFile file_;
  Landmarks shape_;
  GatheredPoints points_;
  std::size_t multipoints_ = 0;
  std::size_t unnamed_ = 0;
};

/// Features in an object or a list.
bool sniff_geojson(std::string_view text) {
  const JsonKeys keys(text);
  const bool is_feature = keys.is_object() && keys.has(1, "geometry") && keys.has(2, "coordinates");
  const bool are_listed = keys.is_list() && keys.has(2, "geometry") && keys.has(3, "coordinates");
  return is_feature || are_listed || (keys.is_object() && keys.has(1, "features") && keys.has(3, "geometry"));
}

LandmarkFile read_geojson(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  return GeoJsonReader(path, json).read();
}

}  // namespace

LandmarkFormat geojson_format() {
  return {.name = "geojson",
          .extensions = {"geojson"},
          .help =
              "GeoJSON, of QuPath: Points with names and MultiPoints as one shape, LineStrings as curves, Polygons as "
              "outlines",
          .sniff = sniff_geojson,
          .read = read_geojson};
}

}  // namespace pulson::formats
