#pragma once

// Curves and outlines: as landmarks, and sampled.

#include <cstddef>
#include <string>

#include "pulson/core/landmarks.hpp"

namespace pulson::io {

/// Makes the points of curves and outlines the landmarks of a shape that has no others, a group for each: `curve 1`.
/// @return whether there were such
bool take_lines_as_landmarks(Landmarks& shape);

/// Undoes it: makes landmarks that are all in groups `curve 1`, `outline 1` and so on curves and outlines again.
/// @return whether they are
bool give_lines_back(Landmarks& shape);

/// The note where that was done.
std::string taken_as_landmarks(std::size_t shapes);

/// The polygon through the points of `line`, from the first to the last or, where it is closed, back to the first.
enum class LineEnds { kOpen, kClosed };

/// `count` points at equal distances of arc length: of an open line with both ends, of a closed one from its first
/// point on. Points that have a missing coordinate are left out. Costs O(line + count).
/// @return NaN where the line has no points
/// @throws InputError where it has no length, or one beyond the largest number
Points evenly_spaced(const Points& line, LineEnds ends, int count);

}  // namespace pulson::io
