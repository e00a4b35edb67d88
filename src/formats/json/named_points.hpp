#pragma once

// Layouts of JSON that programs of people's own write: points by name.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "json_reader.hpp"

namespace pulson::formats {

/// Shapes of named points; none where the value has another layout:
/// {"tip": [1, 2], "fin": {"x": 3, "y": 4}}, a list [{"name": "tip", "x": 1, "y": 2}, ...], which may stand under
/// `landmarks`, `points` or `keypoints`, or an object of several of these, or of lists of points, by the names of
/// shapes. `text` is what the value was parsed from.
std::optional<std::vector<Landmarks>> named_points(const JsonValue& json, std::string_view text);

}  // namespace pulson::formats
