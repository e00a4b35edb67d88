#pragma once

// Points at equal distances along a line.

#include "pulson/core/landmarks.hpp"

namespace pulson::io {

/// The polygon through the points of `line`, from the first to the last or, where it is closed, back to the first.
enum class LineEnds { kOpen, kClosed };

/// `count` points at equal distances of arc length: of an open line with both ends, of a closed one from its first
/// point on. Points that have a missing coordinate are left out. Costs O(line + count).
/// @return NaN where the line has no points
/// @throws InputError where it has no length, or one beyond the largest number
Points evenly_spaced(const Points& line, LineEnds ends, int count);

}  // namespace pulson::io
