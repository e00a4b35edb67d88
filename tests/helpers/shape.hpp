#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// As if read from a.csv.
inline Landmarks shape(Points points, std::vector<std::string> groups = {}) {
  return {.points = std::move(points), .labels = {}, .groups = std::move(groups), .name = {}, .source = "a.csv"};
}

}  // namespace pulson
