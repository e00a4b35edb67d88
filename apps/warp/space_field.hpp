#pragma once

#include "arguments.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson {

/// Refuses `--field` and `--grid-points` of points where there is no field in space to write. @throws InputError
void check_space_field(const WarpArguments& arguments, const warp::MaterialFlow& flow);

/// `--field` of points in 3D: the displacements on a grid about the landmarks that the map leads to, as ITK and 3D
/// Slicer apply them to images and invert them for points, out(x) = in(x + u(x)): u(x) leads from a place of the target
/// to that of the source, with --inverse from the source to the target. Grid and displacements are in LPS where the
/// landmarks' axes are known. @return the line of the summary
std::string write_space_field(const WarpArguments& arguments, const warp::MaterialFlow& flow,
                              const matching::Registration& registration);

}  // namespace pulson
