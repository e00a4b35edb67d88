#pragma once

#include <array>
#include <optional>

#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// β₁ and β₂ where the noise of two landmarks on a line is h₁ = β₁p₁ and h₂ = β₂p₂ with independent Wiener processes,
/// as the pair equation has it; else nothing.
std::optional<std::array<double, 2>> independent_amplitudes(const NoiseModel& noise, const PhaseState& pair);

}  // namespace pulson
