#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// `shape` in the axes and the unit of length of `frame`, where both files say theirs: LPS and RAS differ by the signs
/// of x and y, mm, um, cm and m by a factor. Adds a line to `notes` where that changes the coordinates.
/// @throws InputError if the units are incompatible, such as voxels and mm
Landmarks in_frame_of(const Landmarks& frame, const Landmarks& shape, std::vector<std::string>& notes);

}  // namespace pulson
