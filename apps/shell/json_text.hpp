#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace pulson {

/// A record as it is written. Bytes that are not UTF-8, as paths may hold them, become U+FFFD: JSON cannot hold them.
inline std::string json_text(const nlohmann::ordered_json& json, int indent = 2) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace pulson
