// Markups of 3D Slicer in JSON, by its schema 1.0.3: each of `markups` is a shape, its controlPoints are the landmarks.

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/json/json_reader.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kSchema =
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#";
constexpr std::string_view kType = "type";
constexpr std::string_view kFiducial = "Fiducial";  // that of points; it is no property

// ---- reading

std::string read_axes(const JsonValue& markup) {
  if (!markup.has("coordinateSystem")) return "LPS";  // as the schema has it
  const JsonValue json = markup.at("coordinateSystem");
  const std::string text = json.value().is_number_integer() ? json.value().dump() : json.text();
  if (text == "LPS" || text == "1") return "LPS";
  if (text == "RAS" || text == "0") return "RAS";
  json.fail(fmt::format("is {}; LPS or RAS is expected", text::in_quotes(text)));
}

/// `mm`, or the code, its scheme and its meaning.
std::string read_units(const JsonValue& markup) {
  if (!markup.has("coordinateUnits")) return "mm";
  const JsonValue json = markup.at("coordinateUnits");
  if (!json.value().is_array()) return json.text();
  const std::vector<std::string> coded = json.texts();
  return coded.empty() ? "" : coded.front();
}

/// Whether the status says so, or there is no position and no status that promises one.
bool is_missing_point(const JsonValue& point) {
  const std::string status = point.has("positionStatus") ? point.at("positionStatus").text() : "";
  if (status == "undefined" || status == "missing") return true;
  if (!point.has("position")) return status != "defined";
  const nlohmann::json& position = point.at("position").value();
  return position.is_string() && text::is_missing(position.get<std::string>());
}

double read_coordinate(const nlohmann::json& number, const JsonValue& position) {
  if (number.is_number()) return number.get<double>();
  const bool is_mark = number.is_null() || (number.is_string() && text::is_missing(number.get<std::string>()));
  if (!is_mark) position.fail("is not a list of 3 numbers");
  return text::kMissing;
}

Eigen::Vector3d read_position(const JsonValue& point) {
  if (is_missing_point(point)) return Eigen::Vector3d::Constant(text::kMissing);
  const JsonValue position = point.at("position");
  const bool is_whole = position.value().is_array() && position.value().size() == 3;
  if (!is_whole) position.fail("is not a list of 3 numbers");
  Eigen::Vector3d read;
  for (std::size_t axis = 0; axis < 3; ++axis)
    read[static_cast<Eigen::Index>(axis)] = read_coordinate(position.value()[axis], position);
  return read;
}

std::string read_label(const JsonValue& point) {
  if (!point.has("label")) return "";
  const JsonValue label = point.at("label");
  return label.value().is_number() ? label.value().dump() : label.text();
}

Landmarks read_markup(const JsonValue& markup) {
  if (!markup.value().is_object()) markup.fail("is not an object");
  Landmarks shape;
  if (markup.has("name")) shape.name = markup.at("name").text();
  const std::string type = markup.has("type") ? markup.at("type").text() : std::string(kFiducial);
  if (type != kFiducial) shape.properties.emplace_back(kType, type);
  const std::vector<JsonValue> items =
      markup.has("controlPoints") ? markup.at("controlPoints").items() : std::vector<JsonValue>{};
  shape.points.resize(3, std::ssize(items));
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].value().is_object()) items[i].fail("is not an object");
    shape.points.col(static_cast<Eigen::Index>(i)) = read_position(items[i]);
    shape.labels.push_back(read_label(items[i]));
  }
  shape.labels = text::unless_all_empty(std::move(shape.labels));
  return shape;
}

/// `file` has one for all shapes.
void require_same_units(const JsonValue& markup, const std::string& first, const std::string& other) {
  if (first != other)
    markup.fail(fmt::format("has the units {}, the first has {}; one for all is needed", text::in_quotes(other),
                            text::in_quotes(first)));
}

// ---- writing

/// What Slicer does with the points; a property of this name has it. Planes and ROI need more than points.
std::string type_of(const Landmarks& shape) {
  constexpr std::array<std::string_view, 4> kWritten = {"Curve", "ClosedCurve", "Line", "Angle"};
  for (const auto& [key, text] : shape.properties)
    if (key == kType && std::find(kWritten.begin(), kWritten.end(), text) != kWritten.end()) return text;
  return std::string(kFiducial);
}

Json control_point_json(const Landmarks& shape, const Points& points, int index, bool is_ras) {
  const auto place = static_cast<std::size_t>(index);
  const auto point = points.col(index);
  const bool is_missing = point.hasNaN();
  const std::vector<double> position =
      is_missing ? std::vector<double>(3, 0.0) : std::vector<double>(point.begin(), point.end());
  const double sign = is_ras ? 1 : -1;  // the axes of Slicer, RAS, in these
  return {{"id", std::to_string(index + 1)},
          {"label", shape.labels.empty() ? "" : shape.labels[place]},
          {"description", ""},
          {"associatedNodeID", ""},
          {"position", position},
          {"orientation", std::vector<double>{sign, 0, 0, 0, sign, 0, 0, 0, 1}},
          {"selected", true},
          {"locked", false},
          {"visibility", true},
          {"positionStatus", is_missing ? "missing" : "defined"}};
}

std::string markup_text(const Landmarks& shape, const Points& points, const Json& system, bool& is_changed) {
  Json head = {{"type", type_of(shape)}};
  if (!shape.name.empty()) head["name"] = shape.name;
  head.update(system);
  head["locked"] = false;
  head["fixedNumberOfControlPoints"] = false;
  head["labelFormat"] = "%N-%d";
  head["lastUsedControlPointNumber"] = shape.count();
  std::string text = json_line(head, is_changed);
  text.back() = ',';
  text += "\n    \"controlPoints\": [";
  for (int i = 0; i < shape.count(); ++i)
    text += (i == 0 ? "\n      " : ",\n      ") +
            json_line(control_point_json(shape, points, i, system["coordinateSystem"] == "RAS"), is_changed);
  return text + "\n    ]}";
}

bool misses_some_only(const Landmarks& shape) {
  const std::vector<int> incomplete = incomplete_points(shape.points);
  return std::any_of(incomplete.begin(), incomplete.end(),
                     [&](int index) { return !shape.points.col(index).array().isNaN().all(); });
}

/// The key `markups` with a list.
bool sniff_markups(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  constexpr std::string_view kKey = "\"markups\"";
  const std::size_t begin = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (begin == std::string_view::npos || text[begin] != '{') return false;
  for (std::size_t at = text.find(kKey); at != std::string_view::npos; at = text.find(kKey, at + 1)) {
    const std::size_t colon = text.find_first_not_of(kBlanks, at + kKey.size());
    if (colon == std::string_view::npos || text[colon] != ':') continue;
    const std::size_t list = text.find_first_not_of(kBlanks, colon + 1);
    if (list != std::string_view::npos && text[list] == '[') return true;
  }
  return false;
}

LandmarkFile read_markups(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const std::vector<JsonValue> markups = JsonValue(value, path).at("markups").items();
  if (markups.empty()) throw InputError(path + ": 'markups' is empty; a markup is needed");
  LandmarkFile file;
  for (const JsonValue& markup : markups) {
    Landmarks& shape = file.shapes.emplace_back(read_markup(markup));
    const std::string axes = read_axes(markup);
    if (file.shapes.size() == 1) {
      file.axes = axes;
      file.units = read_units(markup);
    }
    require_same_units(markup, file.units, read_units(markup));
    if (axes != file.axes) {  // LPS and RAS
      shape.points.topRows(2) *= -1;
      file.warnings.push_back(fmt::format("{}: markup {} is in {}, and converted to {} as the first is", path,
                                          file.shapes.size(), axes, file.axes));
    }
    const std::string type = shape.properties.empty() ? "" : shape.properties[0].second;
    if (type == "ROI" || type == "Plane")
      file.warnings.push_back(fmt::format("{}: of markup {}, {} {}, only the control points are read", path,
                                          file.shapes.size(), type == "ROI" ? "an" : "a", type));
  }
  return file;
}

WrittenLandmarks write_markups(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "mrk.json"};
  require_shapes(target, file);
  const bool knows_axes = file.axes.empty() || file.axes == "LPS" || file.axes == "RAS";
  const bool knows_units = file.units.empty() || file.units == "mm" || file.units == "um";
  const Json system = {{"coordinateSystem", file.axes == "RAS" ? "RAS" : "LPS"},
                       {"coordinateUnits", file.units == "um" ? "um" : "mm"}};
  LandmarkFile without_types = file;  // they are kept
  for (Landmarks& shape : without_types.shapes) {
    const auto type = std::pair(std::string(kType), type_of(shape));
    const auto kept = std::find(shape.properties.begin(), shape.properties.end(), type);
    if (type.second != kFiducial && kept != shape.properties.end()) shape.properties.erase(kept);
  }
  WrittenLandmarks written;
  written.losses = losses_of(target, without_types, {.names = true, .labels = true, .units = true, .axes = knows_axes});
  if (!knows_units)
    written.losses.push_back(cannot_hold(target, "the units " + text::in_quotes(file.units)) +
                             "; the numbers will be read as mm");
  bool is_changed = false;
  written.text = fmt::format("{{\n  \"@schema\": \"{}\",\n  \"markups\": [", kSchema);
  for (const Landmarks& shape : file.shapes) {
    const Points points = points_in_space(target, shape, written.losses);
    if (misses_some_only(shape))
      add_once(written.losses, path + ": landmarks that have a missing coordinate are written without any");
    written.text +=
        (&shape == &file.shapes.front() ? "\n    " : ",\n    ") + markup_text(shape, points, system, is_changed);
  }
  written.text += "\n  ]\n}\n";
  if (is_changed) written.losses.push_back(path + ": bytes in names that are not UTF-8 are replaced");
  return written;
}

}  // namespace

LandmarkFormat markups_format() {
  return {.name = "mrk.json",
          .extensions = {"mrk.json"},
          .help = "3D Slicer markups: position, label and positionStatus of controlPoints; each of markups is a shape",
          .sniff = sniff_markups,
          .read = read_markups,
          .write = write_markups};
}

}  // namespace pulson::formats
