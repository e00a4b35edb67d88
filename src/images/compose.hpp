#pragma once

#include <vector>

#include "pulson/images/image.hpp"

namespace pulson {

/// The image in red, green, blue and alpha of 8 bits, for show: 16 bits are divided by 257, floating-point values
/// limited to [0, 1] and multiplied by 255, both rounded. A pixel with a colour that is NaN is transparent.
Image to_rgba8(const Image& image);

// Two images of one size, as of to_rgba8. @throws InputError where the sizes differ

/// Squares of both by turns, `squares` ≥ 1 along the longer side, the first one of `a`.
Image checkerboard(const Image& a, const Image& b, int squares);
/// The mean of both; where one is transparent, the other.
Image blend(const Image& a, const Image& b);
/// White where both agree, grey for the mean difference of their colours, to black for the largest there is; where one
/// is transparent, so is the result.
Image difference(const Image& a, const Image& b);

/// The image with sides divided by `factor` and rounded, at least 1 pixel each, every pixel the mean of the area that
/// it covers; with alpha, in proportion to opacity. The pixel with centre x comes from (x + 1/2)·f - 1/2, where f is
/// the ratio of the sides. @throws InputError unless factor ≥ 1 and finite
Image scaled_down(const Image& image, double factor);

}  // namespace pulson
