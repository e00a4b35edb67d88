#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "pulson/images/image.hpp"
#include "pulson/images/image_warp.hpp"

namespace pulson {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// An image without symmetry, its numbers over the whole range of the type (floats beyond [0, 1] too); alpha at least
/// 1 of 255.
inline images::Image uneven_image(int width, int height, int channels, images::PixelType type) {
  images::Image image(width, height, channels, type);
  std::uint32_t state = 7;
  std::size_t i = 0;
  const auto fill = [&](auto values) {
    for (auto& value : values) {
      state = 1664525 * state + 1013904223;
      const double share = (state >> 8) / 16777216.0;
      const bool is_alpha =
          image.has_alpha() && i++ % static_cast<std::size_t>(channels) + 1 == static_cast<std::size_t>(channels);
      const double scaled = is_floating_point(type) && !is_alpha ? 4 * share - 2 : images::full_value(type) * share;
      const double shown = is_alpha ? std::max(scaled, images::full_value(type) / 255) : scaled;
      value = static_cast<std::remove_reference_t<decltype(value)>>(shown);
    }
  };
  with_number_type(type, [&]<class Value>() { fill(image.values<Value>()); });
  return image;
}

inline images::Image image_u8(int width, int height, int channels, const std::vector<std::uint8_t>& values) {
  return {width, height, channels, std::span<const std::uint8_t>(values)};
}

inline std::vector<double> pixel(const images::Image& image, int x, int y) {
  std::vector<double> numbers;
  for (int c = 0; c < image.channels(); ++c) numbers.push_back(image.at(x, y, c));
  return numbers;
}

inline std::string name_of(const images::Image& image) {
  return std::to_string(image.channels()) + " channels, " + describe(image.type());
}

/// Calls `action` with an image of every type and 1 to 4 channels.
inline void for_every_kind(int width, int height, const std::function<void(const images::Image&)>& action) {
  for (const images::PixelType type : kNumberTypes)
    for (int channels = 1; channels <= 4; ++channels) action(uneven_image(width, height, channels, type));
}

/// The map in which every pixel (x, y) shows place(x, y).
template <class Place>
images::PixelMap map_of(int width, int height, const Place& place) {
  images::PixelMap map{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) map.places.push_back(place(static_cast<float>(x), static_cast<float>(y)));
  return map;
}

}  // namespace pulson
