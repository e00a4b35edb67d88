#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "pulson/fields/grid_fields.hpp"

namespace pulson::fields {

/// A small field of numbers that are hard to write: 4 × 3 [× 2] points.
inline GridField example_field(int d, int components) {
  GridField field;
  field.sizes = {4, 3, 2};
  field.spacing = {0.5, 0.1, 2};
  field.origin = {-1.5, 0.1, 7};
  field.sizes.resize(d);
  field.spacing.resize(d);
  field.origin.resize(d);
  field.components = components;
  field.values.resize((d == 2 ? 12U : 24U) * components);
  for (std::size_t i = 0; i < field.values.size(); ++i) field.values[i] = std::sin(1.0F + static_cast<float>(i));
  field.values[1] = std::numeric_limits<float>::quiet_NaN();
  field.values[2] = -std::numeric_limits<float>::infinity();
  field.values[3] = std::numeric_limits<float>::denorm_min();
  return field;
}

}  // namespace pulson::fields
