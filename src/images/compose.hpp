#pragma once

#include <vector>

#include "pulson/images/image.hpp"

namespace pulson {

/// The image in red, green, blue and alpha of 8 bits, for show: 16 bits are divided by 257, floating-point values
/// limited to [0, 1] and multiplied by 255, both rounded. A pixel with a colour that is NaN is transparent.
Image to_rgba8(const Image& image);

/// The images in a row from the left, as of to_rgba8, with `gap` ≥ 0 transparent pixels between. Lower ones are
/// enlarged to the height of the highest, so that shapes can be compared across images of different resolution. At
/// least one.
Image side_by_side(const std::vector<Image>& images, int gap);

/// The image with sides divided by `factor` and rounded, at least 1 pixel each, every pixel the mean of the area that
/// it covers; with alpha, in proportion to opacity. The pixel with centre x comes from (x + 1/2)·f - 1/2, where f is
/// the ratio of the sides. @throws InputError unless factor ≥ 1 and finite
Image scaled_down(const Image& image, double factor);

}  // namespace pulson
