#pragma once

#include <cstdint>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/images/image.hpp"

namespace pulson {

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

}  // namespace pulson
