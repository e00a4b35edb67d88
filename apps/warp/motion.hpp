#pragma once

#include "image_job.hpp"

namespace pulson {

/// The image on its way, a frame for each time of the flow and a rest at both ends, at most 640 pixels wide or high.
/// @throws InputError where ffmpeg fails
void write_animation(const Image& image, const ImageWarp& warp, const WarpFrames& frames,
                     const WarpArguments& arguments);

}  // namespace pulson
