#pragma once

#include "figures.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// How the image is to be carried. @throws InputError
images::WarpImageOptions warp_options(const WarpArguments& arguments, const WarpFrames& frames,
                                      const images::Page& page);

/// The result of one warp of an image; of samples, their mean.
struct WarpResult : images::WarpedImage {
  std::vector<float> deviations;          ///< of samples, of the result's pixels
  std::vector<float> fold_probabilities;  ///< of samples, of the image's pixels
  double landmark_error = 0;              ///< pixels
};

/// Landmarks carried along, in any dimension; marks that have a missing coordinate stay missing.
struct WarpedPoints {
  Landmarks before;  ///< the first shape, as it was read
  Landmarks after;
  WarpFigures figures;
};

/// Writes the result. @throws InputError
WarpedPoints warp_points(const warp::MaterialFlow& flow, const matching::Registration& registration,
                         const WarpArguments& arguments);

/// The mean of the warped image over samples of the noise with the fitted momenta, the deviation from it and the
/// probability of folds. @throws InputError where there is no noise or no sample has a path
WarpResult warp_samples(const Picture& picture, const matching::Registration& registration, const WarpFrames& frames,
                        const WarpArguments& arguments);

}  // namespace pulson
