#pragma once

#include "pulson/draw/pictures.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// On a line means and the middle nine tenths of positions and momenta over time, and the densities of the positions at
/// the end, of many landmarks for the first few; in the plane and in space the mean shape, an ellipse for each landmark
/// and a fan of paths.
void write_ensemble_picture(const EnsembleRun& run, const PictureFiles& files);

}  // namespace pulson
