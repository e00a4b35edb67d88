#include "named_points.hpp"

#include <algorithm>
#include <array>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"

namespace pulson::formats {
namespace {

bool is_number(const Json& value) { return value.is_number() || value.is_null(); }

bool is_list_of_numbers(const Json& value) {
  return value.is_array() && value.size() >= 2 && value.size() <= 3 &&
         std::all_of(value.begin(), value.end(), is_number);
}

bool has_axes(const Json& value) {
  return value.is_object() && value.contains("x") && value.contains("y") && is_number(value["x"]) &&
         is_number(value["y"]) && (!value.contains("z") || is_number(value["z"]));
}

bool is_place(const Json& value) { return is_list_of_numbers(value) || has_axes(value); }

int dimension_of(const Json& place) {
  return place.is_array() ? static_cast<int>(place.size()) : place.contains("z") ? 3 : 2;
}

Eigen::VectorXd coordinates_of(const Json& place) {
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  Eigen::VectorXd point(dimension_of(place));
  for (Eigen::Index axis = 0; axis < point.size(); ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    const Json& number = place.is_array() ? place[at] : place[kAxes[at]];
    point[axis] = number.is_null() ? text::kMissing : number.get<double>();
  }
  return point;
}

std::string label_in(const Json& item) {
  for (const char* const key : {"name", "label", "landmark", "id"}) {
    if (!item.contains(key)) continue;
    if (item[key].is_string()) return item[key].get<std::string>();
    if (item[key].is_number_integer()) return item[key].dump();
  }
  return {};
}

/// Whether all items are places, all in the plane or all in space.
bool are_places(const Json& items) {
  return !items.empty() && std::all_of(items.begin(), items.end(), [&](const Json& item) {
    return is_place(item) && dimension_of(item) == dimension_of(*items.begin());
  });
}

bool is_shape(const Json& value) {
  return (value.is_object() && !has_axes(value) && are_places(value)) ||
         (value.is_array() && !is_list_of_numbers(value) && are_places(value));
}

/// An object of places by their names, or a list of places, which may name themselves.
Landmarks shape_of(const Json& value) {
  GatheredPoints points(dimension_of(*value.begin()));
  for (const auto& [key, item] : value.items())
    points.add(coordinates_of(item), value.is_object() ? key : item.is_object() ? label_in(item) : std::string());
  Landmarks shape;
  points.move_to(shape);
  return shape;
}

/// What holds the shape: the value, or the value of a key that says so.
const Json& inner_of(const Json& value) {
  if (!value.is_object()) return value;
  for (const char* const key : {"landmarks", "points", "keypoints"})
    if (value.contains(key) && is_shape(value[key])) return value[key];
  return value;
}

}  // namespace

std::optional<std::vector<Landmarks>> named_points(const JsonValue& json, std::string_view text) {
  const std::string path;
  if (!json.value().is_object() && !json.value().is_array()) return std::nullopt;
  const Json value = parse_ordered_json(path, text);
  const Json& inner = inner_of(value);
  if (is_shape(inner)) {
    Landmarks shape = shape_of(inner);
    if (&inner != &value) {
      if (value.contains("name") && value["name"].is_string()) shape.name = value["name"].get<std::string>();
      if (value.contains("image") && value["image"].is_string()) shape.image = value["image"].get<std::string>();
    }
    return std::vector{shape};
  }
  std::vector<Landmarks> shapes;
  for (const auto& [key, item] : value.items()) {
    if (!is_shape(inner_of(item))) return std::nullopt;
    Landmarks& shape = shapes.emplace_back(shape_of(inner_of(item)));
    if (value.is_object())
      shape.name = key;
    else if (item.is_object())
      shape.name = label_in(item);
  }
  if (shapes.empty()) return std::nullopt;
  return shapes;
}

}  // namespace pulson::formats
