#pragma once

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Whether squares and their inverses stay in the range of numbers: coordinates are at most 1e100 in size, and a shape
/// that is not at one place is at least 1e-100 across. Landmarks with a missing coordinate are left out.
/// @throws InputError where they do not, or no landmark has all its coordinates; the message names the shape
void require_usable_range(const Landmarks& shape);

}  // namespace pulson
