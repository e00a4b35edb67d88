#pragma once

#include "image_job.hpp"

namespace pulson {

/// Everything else that was asked for beside the result: field, Jacobians, multiplicity, masks, overlays.
/// @return keys to the pictures of numbers
std::vector<ColourKey> write_more_results(const Image& image, const WarpedImage& result, const ImageWarp& warp,
                                          const WarpFrames& frames, const WarpArguments& arguments);

/// Lines of a regular grid on the image, densely sampled, in its pixels.
std::vector<Points> grid_lines(int width, int height);

/// The landmarks' paths up to step k and the landmarks at their ends, drawn on a picture of the target.
Image with_landmarks(const Image& image, const std::vector<Points>& paths, std::size_t k, double scale);

}  // namespace pulson
