#pragma once

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

}  // namespace pulson::io
