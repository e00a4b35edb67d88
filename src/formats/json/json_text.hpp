#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pulson/core/landmarks.hpp"

namespace pulson {

using Json = nlohmann::ordered_json;

/// The columns of a matrix as a list of lists: [landmark][axis].
Json points_json(const Points& points);

/// JSON without line ends. Bytes of texts that are not UTF-8 are replaced, and then `is_changed` is set.
std::string json_line(const Json& json, bool& is_changed);

/// Valid JSON in which each key of the top level has a line of its own: to be read by people and compared by diff.
std::string one_key_a_line(const Json& json);

}  // namespace pulson
