#pragma once

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// Root mean square distance to the nearest landmarks, whatever they are called, after a similarity without reflection:
/// the larger one of that from the shape to the target and back. By closest points (Besl and McKay 1992) from many
/// rotations. shape, target: d×N, d×M.
double distance_as_set(const Points& shape, const Points& target);

}  // namespace pulson::audit
