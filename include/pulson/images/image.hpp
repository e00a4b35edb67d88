#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace pulson {

/// The type of a pixel's channels, and the value of full brightness or full opacity: 255, 65535 or 1.
enum class PixelDepth : std::uint8_t { kUint8, kUint16, kFloat32 };

/// Bytes of one number.
std::size_t byte_count(PixelDepth depth);
/// 255, 65535 or 1.
double full_value(PixelDepth depth);
/// "8-bit", "16-bit" or "32-bit floating-point", for messages.
std::string describe(PixelDepth depth);

/// The depth that holds numbers of type Value.
template <class Value>
constexpr PixelDepth depth_of() {
  static_assert(std::is_same_v<Value, std::uint8_t> || std::is_same_v<Value, std::uint16_t> ||
                std::is_same_v<Value, float>);
  if constexpr (std::is_same_v<Value, std::uint8_t>) return PixelDepth::kUint8;
  return std::is_same_v<Value, std::uint16_t> ? PixelDepth::kUint16 : PixelDepth::kFloat32;
}

/// A picture: rows from the top, in each the pixels from the left, in each its 1 to 4 channels: grey; grey, alpha; red,
/// green, blue; or red, green, blue, alpha. Alpha is straight: colours are not multiplied by it. The centre of the
/// pixel in column x and row y is the point (x, y), counted from 0; so the picture covers [-1/2, width-1/2] × [-1/2,
/// height-1/2], with y downwards. A copy copies the pixels.
class Image {
 public:
  /// No pixels.
  Image() = default;
  /// All zero: black, and transparent where there is alpha.
  Image(int width, int height, int channels, PixelDepth depth);
  /// With these numbers, as laid out above; Value is uint8_t, uint16_t or float.
  template <class Value>
  Image(int width, int height, int channels, std::span<const Value> values)
      : Image(width, height, channels, depth_of<Value>()) {
    copy_from(std::as_bytes(values));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  PixelDepth depth() const { return depth_; }
  bool empty() const { return bytes_.empty(); }
  bool has_alpha() const { return channels_ % 2 == 0; }
  std::size_t pixel_count() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }

  std::span<std::byte> bytes() { return bytes_; }
  std::span<const std::byte> bytes() const { return bytes_; }

  /// All numbers in order; Value must be that of depth().
  template <class Value>
  std::span<Value> values() {
    assert(depth_of<Value>() == depth_);
    return {reinterpret_cast<Value*>(bytes_.data()), bytes_.size() / sizeof(Value)};
  }
  template <class Value>
  std::span<const Value> values() const {
    assert(depth_of<Value>() == depth_);
    return {reinterpret_cast<const Value*>(bytes_.data()), bytes_.size() / sizeof(Value)};
  }

  /// One number of one pixel, whatever the depth; slow.
  double at(int x, int y, int channel) const;

  /// Same size, channels, depth and bytes.
  friend bool operator==(const Image&, const Image&) = default;

 private:
  void copy_from(std::span<const std::byte> bytes);

  int width_ = 0;
  int height_ = 0;
  int channels_ = 1;
  PixelDepth depth_ = PixelDepth::kUint8;
  std::vector<std::byte> bytes_;
};

}  // namespace pulson
