#pragma once

#include <cstdint>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Where the landmarks may be at half of the time on their way from `source` to `target` by way number `index`: 1 and 2
/// turn the halfway shape by a quarter about its centre, to the left and to the right (in space about the axis in which
/// the shape is thinnest); on a line and from 3 on it is displaced by a smooth random field of half a diameter.
Points halfway(const Points& source, const Points& target, int index, std::uint64_t seed);

}  // namespace pulson
