#include "pulson/images/image.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "pulson/core/errors.hpp"

namespace pulson::images {

double full_value(PixelType type) {
  return with_number_type(type, []<class Value>() {
    return std::is_floating_point_v<Value> ? 1.0 : static_cast<double>(std::numeric_limits<Value>::max());
  });
}

PixelFormat PixelFormat::usual(int channels, PixelType type) {
  const bool has_alpha = channels == 2 || channels == 4;
  return {channels, type, has_alpha ? Alpha::kStraight : Alpha::kNone, full_value(type)};
}

Image::Image(int width, int height, const PixelFormat& format) : width_(width), height_(height), format_(format) {
  if (width <= 0 || height <= 0 || format.channels < 1)
    throw InputError("image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                     std::to_string(format.channels) + " channels: sizes and channels must be positive");
  bytes_.resize(pixel_count() * pixel_size());
}

void Image::copy_from(std::span<const std::byte> bytes) {
  if (bytes.size() != bytes_.size())
    throw InputError("image of " + std::to_string(width_) + " x " + std::to_string(height_) + " pixels: there are " +
                     std::to_string(bytes.size()) + " bytes for its " + std::to_string(bytes_.size()));
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
}

double Image::at(int x, int y, int channel) const {
  assert(x >= 0 && x < width_ && y >= 0 && y < height_ && channel >= 0 && channel < channels());
  const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  const std::size_t index = pixel * static_cast<std::size_t>(channels()) + static_cast<std::size_t>(channel);
  return with_number_type(type(), [&]<class Value>() { return static_cast<double>(values<Value>()[index]); });
}

// Orientations as in TIFF 6.0, section 8.
Image oriented(const Image& stored, int orientation) {
  if (orientation < 2 || orientation > 8) return stored;
  const bool is_transposed = orientation > 4;
  const bool flips_x = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool flips_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  Image result(is_transposed ? stored.height() : stored.width(), is_transposed ? stored.width() : stored.height(),
               stored.format());
  const std::size_t size = stored.pixel_size();
  std::byte* to = result.bytes().data();
  for (int y = 0; y < result.height(); ++y)
    for (int x = 0; x < result.width(); ++x, to += size) {
      const int column = is_transposed ? y : x, line = is_transposed ? x : y;
      const auto from_x = static_cast<std::size_t>(flips_x ? stored.width() - 1 - column : column);
      const auto from_y = static_cast<std::size_t>(flips_y ? stored.height() - 1 - line : line);
      const std::size_t from = from_y * static_cast<std::size_t>(stored.width()) + from_x;
      std::memcpy(to, stored.bytes().data() + from * size, size);
    }
  return result;
}

}  // namespace pulson::images
