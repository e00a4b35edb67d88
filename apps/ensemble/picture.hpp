#pragma once

#include "draw/ensemble_picture.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// On a line means and the middle nine tenths of positions and momenta over time, and the densities of the positions at
/// the end, of many landmarks for the first few; in the plane and in space the mean shape, an ellipse for each landmark
/// and a fan of paths.
/// @param shape of make_ensemble_picture
void write_ensemble_picture(const records::EnsembleRun& run, const draw::EnsemblePicture& shape,
                            const draw::PictureFiles& files);

/// Whether an ensemble is so small that its paths are kept for the picture: to sample some of them again would cost
/// more than a fifth of it.
bool keeps_for_picture(const ensemble::EnsembleOptions& options, const PhaseState& start);

/// The mean shape of an ensemble in any dimension, the covariances at its end and some of its paths: those kept, or at
/// most a fifth of all sampled again.
draw::EnsemblePicture make_ensemble_picture(const records::EnsembleRun& run);

}  // namespace pulson
