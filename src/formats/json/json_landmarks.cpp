// Landmarks in JSON: a layout of our own that holds all of them to the bit, lists of points, lists of these, and the
// shapes of our registration.json.

#include "json_landmarks.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/frame_text.hpp"
#include "formats/landmark_writers.hpp"
#include "named_points.hpp"

namespace pulson::formats {
namespace {

constexpr std::array<std::string_view, 13> kShapeKeys = {"name",  "points",     "labels", "groups",   "image",
                                                         "scale", "properties", "curves", "outlines", "y_down",
                                                         "frame", "links",      "absent"};
constexpr std::array<std::string_view, 3> kFileKeys = {"shapes", "units", "axes"};

// ---- reading

template <std::size_t kCount>
void note_unknown(const JsonValue& object, const std::array<std::string_view, kCount>& known,
                  std::set<std::string>& unknown) {
  for (const auto& [key, value] : object.value().items())
    if (std::find(known.begin(), known.end(), key) == known.end()) unknown.insert(key);
}

std::vector<std::string> read_names(const JsonValue& object, const std::string& key, int count) {
  if (!object.has(key)) return {};
  std::vector<std::string> names = object.at(key).texts();
  if (!names.empty() && names.size() != static_cast<std::size_t>(count))
    object.at(key).fail(fmt::format("has {} for {}", text::counted(names.size(), "item"),
                                    text::counted(static_cast<std::size_t>(count), "point")));
  return names;
}

/// An object, or a list of pairs.
std::vector<std::pair<std::string, std::string>> read_properties(const JsonValue& properties) {
  std::vector<std::pair<std::string, std::string>> all;
  if (properties.value().is_object()) {
    for (const auto& [key, value] : properties.value().items()) all.emplace_back(key, properties.at(key).text());
    return all;
  }
  for (const JsonValue& pair : properties.items()) {
    const std::vector<std::string> texts = pair.texts();
    if (texts.size() != 2) pair.fail("is not a pair of strings");
    all.emplace_back(texts[0], texts[1]);
  }
  return all;
}

std::vector<Points> read_lines(const JsonValue& shape, const std::string& key) {
  std::vector<Points> lines;
  if (!shape.has(key)) return lines;
  for (const JsonValue& line : shape.at(key).items()) lines.push_back(line.points());
  return lines;
}

/// Landmarks by their numbers from 1, which have no coordinates.
std::vector<int> read_absent(const JsonValue& json, const Points& points) {
  std::set<int> absent;
  for (const JsonValue& item : json.items()) {
    const int number = item.count();
    if (number < 1 || number > points.cols()) item.fail(fmt::format("is no landmark; they are 1 to {}", points.cols()));
    if (!points.col(number - 1).array().isNaN().all()) item.fail("is absent, and has coordinates");
    absent.insert(number - 1);
  }
  return {absent.begin(), absent.end()};
}

Landmarks read_shape(const JsonValue& json, std::set<std::string>& unknown) {
  if (!json.value().is_object()) json.fail("is not an object with the key 'points'");
  note_unknown(json, kShapeKeys, unknown);
  Landmarks shape;
  shape.points = json.at("points").points();
  shape.labels = read_names(json, "labels", shape.count());
  shape.groups = read_names(json, "groups", shape.count());
  if (json.has("name")) shape.name = json.at("name").text();
  if (json.has("image")) shape.image = json.at("image").text();
  if (json.has("scale")) shape.scale = json.at("scale").number();
  if (json.has("properties")) shape.properties = read_properties(json.at("properties"));
  if (json.has("y_down")) {
    shape.frame.y_down = json.at("y_down").boolean();
    shape.frame.says_y = true;
  }
  if (json.has("frame")) shape.frame = read_frame(json.at("frame"));
  shape.curves = read_lines(json, "curves");
  shape.outlines = read_lines(json, "outlines");
  if (json.has("links")) shape.links = json.at("links").links(shape.count(), 1);
  if (json.has("absent")) shape.absent = read_absent(json.at("absent"), shape.points);
  return shape;
}

/// Of a list of points, or of lists of points.
std::vector<Landmarks> listed_shapes(const JsonValue& json) {
  const auto is_array = [](const nlohmann::json& item) { return item.is_array(); };
  const nlohmann::json& value = json.value();
  const bool has_lists = std::any_of(value.begin(), value.end(), [&](const nlohmann::json& item) {
    return item.is_array() && std::any_of(item.begin(), item.end(), is_array);
  });
  std::vector<Landmarks> shapes;
  for (const JsonValue& list : has_lists ? json.items() : std::vector<JsonValue>{json})
    shapes.emplace_back().points = list.points();
  return shapes;
}

bool is_registration(const JsonValue& json) { return json.has("source") && json.has("target") && json.has("result"); }

std::vector<Landmarks> registered_shapes(const JsonValue& json) {
  std::vector<Landmarks> shapes;
  for (const std::string name : {"source", "target", "result"}) {
    Landmarks& shape = shapes.emplace_back();
    shape.name = name;
    shape.points = json.at(name).points();
    const std::string from = name == "target" ? "target_shape" : "source_shape";
    if (!json.has(from)) continue;
    shape.labels = read_names(json.at(from), "labels", shape.count());
    shape.groups = read_names(json.at(from), "groups", shape.count());
    if (json.at(from).has("frame")) shape.frame = read_frame(json.at(from).at("frame"));
  }
  return shapes;
}

void read_shapes(const JsonValue& json, LandmarkFile& file, std::set<std::string>& unknown) {
  note_unknown(json, kFileKeys, unknown);
  for (const JsonValue& shape : json.at("shapes").items()) file.shapes.push_back(read_shape(shape, unknown));
  if (file.shapes.empty()) json.at("shapes").fail("is empty; a shape is needed");
}

// ---- writing

/// An object keeps neither order nor two of one name.
Json properties_json(const std::vector<std::pair<std::string, std::string>>& properties) {
  const auto is_before = [](const auto& a, const auto& b) { return a.first < b.first; };
  const bool rises = std::adjacent_find(properties.begin(), properties.end(), [&](const auto& a, const auto& b) {
                       return !is_before(a, b);
                     }) == properties.end();
  Json json = rises ? Json::object() : Json::array();
  for (const auto& [key, text] : properties) {
    if (rises)
      json.emplace(key, text);
    else
      json.push_back(Json::array({key, text}));
  }
  return json;
}

Json lines_json(const std::vector<Points>& lines) {
  Json json = Json::array();
  for (const Points& line : lines) json.push_back(points_json(line));
  return json;
}

Json numbers_from_one(const std::vector<int>& landmarks) {
  Json json = Json::array();
  for (const int a : landmarks) json.push_back(a + 1);
  return json;
}

}  // namespace

Json shape_json(const Landmarks& shape) {
  Json json = Json::object();
  if (!shape.name.empty()) json["name"] = shape.name;
  if (!shape.image.empty()) json["image"] = shape.image;
  if (shape.scale) json["scale"] = *shape.scale;
  if (const bool says = shape.frame.says_y || !frame_text(shape.frame).empty(); says && shape.dimension() == 2)
    json["frame"] = frame_json(shape.frame);
  if (!shape.properties.empty()) json["properties"] = properties_json(shape.properties);
  json["points"] = points_json(shape.points);
  if (!shape.labels.empty()) json["labels"] = shape.labels;
  if (!shape.groups.empty()) json["groups"] = shape.groups;
  if (!shape.links.empty()) json["links"] = links_json(shape.links);
  if (!shape.absent.empty()) json["absent"] = numbers_from_one(shape.absent);
  if (!shape.curves.empty()) json["curves"] = lines_json(shape.curves);
  if (!shape.outlines.empty()) json["outlines"] = lines_json(shape.outlines);
  return json;
}

Landmarks shape_of_json(const JsonValue& json) {
  std::set<std::string> unknown;
  return read_shape(json, unknown);
}

namespace {

/// An object or a list; a word in brackets begins other texts, such as `[individuals]` of morphologika.
bool sniff_json(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n\xEF\xBB\xBF"), text.size()));
  if (text.starts_with('{')) return true;
  if (!text.starts_with('[')) return false;
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks, 1), text.size()));
  const bool begins_with_word = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0;
  return !begins_with_word || text.starts_with("null");
}

/// Points that name themselves, or by name.
bool holds_objects(const nlohmann::json& points) {
  return points.is_object() || (points.is_array() && !points.empty() && points.front().is_object());
}

LandmarkFile read_json(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  LandmarkFile file;
  std::set<std::string> unknown;
  if (value.is_array() && !holds_objects(value))
    file.shapes = listed_shapes(json);
  else if (json.has("shapes"))
    read_shapes(json, file, unknown);
  else if (json.has("points") && !holds_objects(json.at("points").value()))
    file.shapes.push_back(read_shape(json, unknown));
  else if (is_registration(json))
    file.shapes = registered_shapes(json);
  else if (std::optional<std::vector<Landmarks>> named = named_points(json, text))
    file.shapes = *std::move(named);
  else
    json.fail(
        "holds no landmarks in a layout that is known: an object with the key 'shapes' or 'points', points by name "
        "such "
        "as {\"tip\": [1, 2]}, or a list of points");
  if (json.has("units")) file.units = json.at("units").text();
  if (json.has("axes")) file.axes = json.at("axes").text();
  unknown.erase("units");
  unknown.erase("axes");
  for (const std::string& key : unknown)
    file.warnings.push_back(fmt::format("{}: the key {} is not used", path, text::in_quotes(key)));
  return file;
}

WrittenLandmarks write_json(const std::string& path, const LandmarkFile& file) {
  WrittenLandmarks written;
  bool is_changed = false;
  require_shapes({path, "json"}, file);
  for (const Landmarks& shape : file.shapes)
    written.text +=
        (written.text.empty() ? "{\n  \"shapes\": [\n    " : ",\n    ") + json_line(shape_json(shape), is_changed);
  written.text += "\n  ]";
  if (!file.units.empty()) written.text += ",\n  \"units\": " + json_line(file.units, is_changed);
  if (!file.axes.empty()) written.text += ",\n  \"axes\": " + json_line(file.axes, is_changed);
  written.text += "\n}\n";
  if (is_changed) written.losses.push_back(path + ": bytes in names that are not UTF-8 are replaced");
  return written;
}

}  // namespace

LandmarkFormat json_format() {
  return {
      .name = "json",
      .extensions = {"json"},
      .help =
          R"({"shapes": [{"name": "a", "points": [[0, 1], [2, null], [null, null]], "labels": ["tip", "fin", "bone"], "groups": ["1", "1", "2"], )"
          R"("image": "a.jpg", "scale": 0.1, "frame": {"y_down": false, "unit_per_pixel": 0.02}, )"
          R"("properties": {"COMMENT": "old"}, "curves": [[[0, 1], [2, 3]]], )"
          R"("outlines": [], "links": [[1, 2]], "absent": [3]}], "units": "mm", "axes": "RAS"}; only points are needed and null is missing; )"
          R"(properties are [["COMMENT", "old"]] where their order matters; also a single shape, its points only, )"
          "a list of such lists, or registration.json as shapes source, target and result",
      .sniff = sniff_json,
      .read = read_json,
      .write = write_json};
}

}  // namespace pulson::formats
