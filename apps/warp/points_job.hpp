#pragma once

#include "figures.hpp"

namespace pulson {

/// Landmarks carried along, in any dimension; marks that have a missing coordinate stay missing. @throws InputError
WarpFigures warp_points(const MaterialFlow& flow, const Registration& registration, const WarpArguments& arguments);

}  // namespace pulson
