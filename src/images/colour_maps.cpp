#include "pulson/images/colour_maps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

/// Every seventeenth of the 256 published colours.
constexpr std::array<Rgb, 16> kViridis{{{0x44, 0x01, 0x54},
                                        {0x48, 0x1A, 0x6C},
                                        {0x47, 0x2F, 0x7D},
                                        {0x41, 0x44, 0x87},
                                        {0x39, 0x56, 0x8C},
                                        {0x31, 0x68, 0x8E},
                                        {0x2A, 0x78, 0x8E},
                                        {0x23, 0x88, 0x8E},
                                        {0x1F, 0x98, 0x8B},
                                        {0x22, 0xA8, 0x84},
                                        {0x35, 0xB7, 0x79},
                                        {0x54, 0xC5, 0x68},
                                        {0x7A, 0xD1, 0x51},
                                        {0xA5, 0xDB, 0x36},
                                        {0xD2, 0xE2, 0x1B},
                                        {0xFD, 0xE7, 0x25}}};

/// The eleven colours of RdBu from blue to red, the middle one made white.
constexpr std::array<Rgb, 11> kBlueWhiteRed{{{0x05, 0x30, 0x61},
                                             {0x21, 0x66, 0xAC},
                                             {0x43, 0x93, 0xC3},
                                             {0x92, 0xC5, 0xDE},
                                             {0xD1, 0xE5, 0xF0},
                                             {0xFF, 0xFF, 0xFF},
                                             {0xFD, 0xDB, 0xC7},
                                             {0xF4, 0xA5, 0x82},
                                             {0xD6, 0x60, 0x4D},
                                             {0xB2, 0x18, 0x2B},
                                             {0x67, 0x00, 0x1F}}};

/// Next to dark blue it stands out to the colour-blind too.
constexpr Rgb kMark{0xF0, 0xE4, 0x42};

/// The colour at `place` in [0, 1] of equally spaced control points.
Rgb colour_at(std::span<const Rgb> points, double place) {
  const double position = std::clamp(place, 0.0, 1.0) * static_cast<double>(points.size() - 1);
  const std::size_t left = std::min(static_cast<std::size_t>(position), points.size() - 2);
  const double share = position - static_cast<double>(left);
  Rgb colour;
  for (std::size_t c = 0; c < colour.size(); ++c)
    colour[c] = static_cast<std::uint8_t>(std::lround((1 - share) * points[left][c] + share * points[left + 1][c]));
  return colour;
}

template <class ColourOf>
Image coloured(const std::vector<float>& values, int width, int height, const ColourOf& colour_of) {
  Image image(width, height, 4, PixelDepth::kUint8);
  if (values.size() != image.pixel_count())
    throw InputError("image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels: there are " +
                     std::to_string(values.size()) + " numbers");
  auto pixel = image.values<std::uint8_t>().begin();
  for (const float value : values) {
    if (!std::isnan(value)) {
      const Rgb colour = colour_of(value);
      std::copy(colour.begin(), colour.end(), pixel);
      pixel[3] = 255;
    }
    pixel += 4;
  }
  return image;
}

}  // namespace

Image viridis(const std::vector<float>& values, int width, int height, double low, double high) {
  if (!(low < high) || !std::isfinite(low) || !std::isfinite(high))
    throw InputError("colours from " + std::to_string(low) + " to " + std::to_string(high) +
                     ": the first must be less than the second, both finite");
  return coloured(values, width, height,
                  [&](float value) { return colour_at(kViridis, (value - low) / (high - low)); });
}

Image diverging(const std::vector<float>& values, int width, int height, const DivergingScale& scale) {
  if (!(scale.reach > 0) || !std::isfinite(scale.reach) || !std::isfinite(scale.centre))
    throw InputError("colours that reach " + std::to_string(scale.reach) + " from " + std::to_string(scale.centre) +
                     ": the first must be greater than 0, both finite");
  return coloured(values, width, height, [&](float value) {
    if (scale.marked_below && value < *scale.marked_below) return kMark;
    return colour_at(kBlueWhiteRed, 0.5 + 0.5 * (value - scale.centre) / scale.reach);
  });
}

}  // namespace pulson
