#pragma once

#include <optional>

#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// The noise `p-sd` of bumps φ_f(x) = exp(−|x − c_f|²/width²), whose channel f·d + j is the field β φ_f e_j.
struct BumpFields {
  Points centres;  ///< d×F
  double beta = 0;
  double width = 0;
};

/// None for another noise, sums included.
std::optional<BumpFields> bump_fields(const NoiseModel& noise);

}  // namespace pulson
