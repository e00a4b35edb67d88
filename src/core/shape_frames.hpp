#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Calls change(points) for the landmarks of a shape, and for each of the curves and outlines beside them.
template <class Change>
void change_points(Landmarks& shape, const Change& change) {
  change(shape.points);
  for (Points& curve : shape.curves) change(curve);
  for (Points& outline : shape.outlines) change(outline);
}

/// How many metres a unit of length has, such as `mm`; none where it is not known.
std::optional<double> metres(std::string_view unit);

/// The same shape in its picture, with y counted in the other direction. @param shape in the plane, of a picture whose
/// height is known
void mirror_y(Landmarks& shape);

/// `shape` in the axes and the unit of length of `frame`, where both files say theirs, and with y in its direction: LPS
/// and RAS differ by the signs of x and y, mm, um, cm and m by a factor, y upwards and downwards by the height of the
/// picture. Adds a line to `notes` where that changes the coordinates.
/// @throws InputError if the units are incompatible, such as voxels and mm, or if the directions of y differ and the
/// height of the picture of `shape` is not known
Landmarks in_frame_of(const Landmarks& frame, const Landmarks& shape, std::vector<std::string>& notes);

}  // namespace pulson
