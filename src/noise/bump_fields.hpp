#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// The noise `p-sd` of bumps φ_f(x) = exp(−|x − c_f|²/width²), whose channel f·d + j is the field β φ_f e_j.
struct BumpFields {
  Points centres;  ///< d×F
  double beta = 0;
  double width = 0;
};

/// The coordinates of centres, each once on every axis: φ_f is a product over axes, exp(−(x_j − tick)²/width²) each, of
/// which a grid has few.
struct BumpTicks {
  explicit BumpTicks(const Points& centres);

  std::vector<double> ticks;           ///< those of the first axis, then those of the next
  std::vector<std::size_t> first;      ///< of each axis, and their number: d + 1 numbers
  std::vector<std::size_t> of_centre;  ///< of centre f on axis j, at f·d + j
};

/// None for another noise, sums included.
std::optional<BumpFields> bump_fields(const NoiseModel& noise);

}  // namespace pulson
