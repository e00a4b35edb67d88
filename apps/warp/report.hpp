#pragma once

#include "jobs.hpp"

namespace pulson {

/// `--report` of a warped image: the numbers, the image as it moves with its grid and landmarks, the result over the
/// target's image (or the image), before and after, and the Jacobian. @throws InputError where a file cannot be written
void write_warp_report(const images::Image& image, const images::WarpedImage& result, const WarpFigures& figures,
                       const images::ImageWarp& warp, const WarpFrames& frames,
                       const matching::Registration& registration, const WarpArguments& arguments);

/// `--report` of landmarks: the numbers, the points as they move, and where each ends.
void write_warp_report(const WarpedPoints& points, const warp::MaterialFlow& flow,
                       const matching::Registration& registration, const WarpArguments& arguments);

}  // namespace pulson
