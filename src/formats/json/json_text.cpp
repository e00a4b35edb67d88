#include "json_text.hpp"

#include <vector>

namespace pulson {

Json points_json(const Points& points) {
  Json rows = Json::array();
  for (const auto& column : points.colwise()) rows.push_back(std::vector<double>(column.begin(), column.end()));
  return rows;
}

std::string json_line(const Json& json, bool& is_changed) {
  try {
    return json.dump();
  } catch (const Json::type_error&) {
    is_changed = true;
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

std::string one_key_a_line(const Json& json) {
  std::string text = "{";
  for (const auto& [key, value] : json.items())
    text += (text.size() > 1 ? ",\n  " : "\n  ") + Json(key).dump() + ": " +
            value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text + "\n}\n";
}

}  // namespace pulson
