#pragma once

#include <opencv2/core.hpp>

#include "pulson/images/image.hpp"

namespace pulson::images {

/// OpenCV's type of a pixel.
int mat_type(PixelDepth depth, int channels);

/// OpenCV's view of the pixels, valid as long as they are. A function of OpenCV whose result has this size and type
/// writes into the image; with another it would let go of it.
cv::Mat mat_of(Image& image);
/// For reading alone, which cv::Mat has no word for.
cv::Mat mat_of(const Image& image);

}  // namespace pulson::images
