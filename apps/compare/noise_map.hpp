#pragma once

#include "pulson/compare/comparison.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson {

/// Whether there is a map: shapes in the plane that the noise of some model moves.
bool has_noise_map(const compare::Comparison& comparison);

/// Where the noise of each model acts on the shape: about each landmark of the source a disc whose radius is the root
/// mean square displacement by the noise, magnified where it is small.
void write_noise_map(const compare::Comparison& comparison, const draw::PictureFiles& files);

}  // namespace pulson
