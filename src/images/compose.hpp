#pragma once

#include <cstdint>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/images/image.hpp"

namespace pulson::images {

/// The image in red, green, blue and alpha of 8 bits, for show: the highest value becomes 255, rounded; of
/// floating-point numbers 1 does, and they are limited to [0, 1]. Of channels that are no colours it is the first. A
/// pixel with a colour that is NaN is transparent.
Image to_rgba8(const Image& image);

/// Red, green and blue of an image as of to_rgba8, on white, three bytes a pixel.
std::vector<std::uint8_t> rgb_on_white(const Image& image);

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

/// Red, green, blue and opacity, each of 0 to 255.
struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0, alpha = 255;
};

struct LineStyle {
  Colour colour;
  int thickness = 1;  ///< pixels, at least 1
  bool antialias = true;
};

/// The image, as of to_rgba8, with lines laid over it. Where they cross a half-transparent colour does not add up.
/// @param lines each 2×N, one vertex a column, x to the right and y downwards in pixels with pixel centres at integers,
/// drawn to 1/256 pixel; a vertex that is not finite, or farther than a million pixels off, interrupts the line. One
/// single vertex is a dot as wide as the line; a closed line repeats its first vertex.
Image blend_lines(const Image& image, const std::vector<Points>& lines, const LineStyle& style);

/// The image, as of to_rgba8, with circles laid over it. @param centres 2×N as for blend_lines; centres that are not
/// finite are left out @param radius pixels to the middle of the line, at least 0
Image blend_rings(const Image& image, const Points& centres, double radius, const LineStyle& style);

}  // namespace pulson::images
