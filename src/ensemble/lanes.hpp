#pragma once

#include <array>
#include <cstddef>

namespace pulson {

/// So many neighbouring paths at a time, the unit of work: a multiple of two vectors of every target.
inline constexpr std::size_t kPathBatch = 64;

using PathLanes = std::array<double, kPathBatch>;

}  // namespace pulson
