#pragma once

// One shape in our own layout of JSON, for files that hold shapes beside other things.

#include "json_reader.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// All of a shape but its address, units and axes, which files hold once for all of theirs: one of `shapes` of the
/// format `json`.
Json shape_json(const Landmarks& shape);
/// The same back. @throws InputError that names the place where it is wrong
Landmarks shape_of_json(const JsonValue& json);

}  // namespace pulson::formats
