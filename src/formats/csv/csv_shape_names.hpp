#pragma once

// How columns of a table with a shape per line name coordinates.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace pulson::io {

/// A column as `X1` or `1.X` names it, or `nose_x`.
struct CoordinateName {
  std::size_t axis;
  std::optional<std::size_t> number;  ///< of the landmark
  std::string label;                  ///< where it has no number
};

/// `X1`, `1.X`, `LM 1_X`, `x[1]`
std::optional<CoordinateName> parse_numbered_coordinate(std::string_view name);

/// `nose_x`, `nose.X`, `noseX`, `L1x` or `x_nose`
std::optional<CoordinateName> parse_named_coordinate(std::string_view name);

}  // namespace pulson::io
