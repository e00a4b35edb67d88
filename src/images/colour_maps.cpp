#include "images/colour_maps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/colours.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {
namespace {

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

template <class ColourOf>
Image coloured(const std::vector<float>& values, int width, int height, const ColourOf& colour_of) {
  Image image(width, height, 4, PixelType::kUint8);
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

}  // namespace pulson::images
