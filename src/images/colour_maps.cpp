#include "images/colour_maps.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/colours.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {
namespace {

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
