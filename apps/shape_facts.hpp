#pragma once

#include <cstddef>
#include <optional>
#include <utility>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// What `pulson info` reports about a shape beyond its contents.
struct ShapeFacts {
  std::size_t missing = 0;                              ///< landmarks that have a missing coordinate
  std::size_t coincident = 0;                           ///< landmarks at the place of an earlier one
  std::optional<std::pair<int, int>> first_coincident;  ///< the first of these and the one before it at its place
  /// The shape or a group of three or more ends where it begins: the last landmark repeats the first. Such are among
  /// the coincident ones.
  bool repeats_end = false;
};

/// In O(N log N).
ShapeFacts shape_facts(const Landmarks& shape);

}  // namespace pulson
