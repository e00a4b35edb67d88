#pragma once

#include "image_job.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The mean of the warped image over samples of the noise with the fitted momenta, the deviation from it and the
/// probability of folds. @throws InputError where there is no noise or no sample has a path
WarpedImage warp_samples(const Image& image, const Registration& registration, const WarpFrames& frames,
                         const WarpArguments& arguments);

}  // namespace pulson
