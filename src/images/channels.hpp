#pragma once

#include <functional>

#include <opencv2/core.hpp>

#include "pulson/images/pages.hpp"

namespace pulson::images {

/// OpenCV's type of a pixel of 8, 16 or floating-point 32 bits.
int mat_type(PixelType type, int channels);

/// OpenCV's view of the pixels, valid as long as they are. A function of OpenCV whose result has this size and type
/// writes into the image; with another it would let go of it.
cv::Mat mat_of(Image& image);
/// For reading alone, which cv::Mat has no word for.
cv::Mat mat_of(const Image& image);

/// The image with an alpha channel, opaque where it had none.
Image with_alpha(const Image& image);
/// The image in red, green and blue, grey ones with three equal channels; alpha is kept.
Image with_colours(const Image& image);

/// Red, green and blue of an image of three channels, or the first of one of any other number; alpha is kept.
Image first_channels(const Image& image);

/// The image with its colours divided by the alpha that they were multiplied by.
Image with_straight_alpha(const Image& image);

/// The grey page with its numbers from the other end, where 0 is white.
Page with_black_as_zero(Page page);

/// Pixels with alpha in float32, colours multiplied by alpha / full_value: what is transparent has no colour to mix in.
cv::Mat premultiplied(const cv::Mat& straight);

/// The inverse, rounded to the depth of `result`, whose size and channels are those of `pixels`. Alpha is limited to
/// [0, full_value]; where it is 0 the colour is 0.
void unpremultiply(const cv::Mat& pixels, Image& result);

/// result = filter(source) for a filter that takes weighted means of pixels: with alpha, of premultiplied ones. The
/// filter makes a cv::Mat of the size of `result` and the type of its input. The source is of its depth and channels.
void filter_pixels(const cv::Mat& source, Image& result, const std::function<void(const cv::Mat&, cv::Mat&)>& filter);

}  // namespace pulson::images
