#include "pulson/images/image.hpp"

#include <algorithm>
#include <string>

#include "pulson/core/errors.hpp"

namespace pulson {

std::size_t byte_count(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return 1;
  return depth == PixelDepth::kUint16 ? 2 : 4;
}

double full_value(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return 255;
  return depth == PixelDepth::kUint16 ? 65535 : 1;
}

std::string describe(PixelDepth depth) {
  if (depth == PixelDepth::kUint8) return "8-bit";
  return depth == PixelDepth::kUint16 ? "16-bit" : "32-bit floating-point";
}

Image::Image(int width, int height, int channels, PixelDepth depth)
    : width_(width), height_(height), channels_(channels), depth_(depth) {
  if (width <= 0 || height <= 0 || channels < 1 || channels > 4)
    throw InputError("image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                     std::to_string(channels) + " channels: sizes must be positive, and channels 1 to 4");
  bytes_.resize(pixel_count() * static_cast<std::size_t>(channels) * byte_count(depth));
}

void Image::copy_from(std::span<const std::byte> bytes) {
  if (bytes.size() != bytes_.size())
    throw InputError("image of " + std::to_string(width_) + " x " + std::to_string(height_) + " pixels: there are " +
                     std::to_string(bytes.size()) + " bytes for its " + std::to_string(bytes_.size()));
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
}

double Image::at(int x, int y, int channel) const {
  assert(x >= 0 && x < width_ && y >= 0 && y < height_ && channel >= 0 && channel < channels_);
  const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  const std::size_t index = pixel * static_cast<std::size_t>(channels_) + static_cast<std::size_t>(channel);
  if (depth_ == PixelDepth::kUint8) return values<std::uint8_t>()[index];
  return depth_ == PixelDepth::kUint16 ? values<std::uint16_t>()[index] : values<float>()[index];
}

}  // namespace pulson
