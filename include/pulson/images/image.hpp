#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/number_type.hpp"

namespace pulson::images {

using PixelType = NumberType;

/// The value of full brightness or full opacity unless a picture says another: the highest of whole numbers, 1 of
/// floating-point ones.
double full_value(PixelType type);

/// What the last channel says of the others: nothing; their opacity; or opacity that they are multiplied by already.
enum class Alpha : std::uint8_t { kNone, kStraight, kAssociated };

/// What the numbers of a pixel are.
struct PixelFormat {
  int channels = 1;
  PixelType type = PixelType::kUint8;
  Alpha alpha = Alpha::kNone;  ///< the last channel
  double full = 255;           ///< of brightness and opacity; whole numbers are at most this

  /// 2 and 4 channels have straight alpha, full is full_value.
  static PixelFormat usual(int channels, PixelType type);

  bool has_alpha() const { return alpha != Alpha::kNone; }
  /// Channels without alpha.
  int colours() const { return has_alpha() ? channels - 1 : channels; }
  friend bool operator==(const PixelFormat&, const PixelFormat&) = default;
};

/// A picture: rows from the top, in each the pixels from the left, in each its channels: grey; red, green and blue; or
/// any other number, of which nothing is known; alpha may follow. The centre of the pixel in column x and row y is the
/// point (x, y), counted from 0; so the picture covers [-1/2, width-1/2] × [-1/2, height-1/2], with y downwards. A copy
/// copies the pixels.
class Image {
 public:
  /// No pixels.
  Image() = default;
  /// All zero: black, and transparent where there is alpha.
  Image(int width, int height, const PixelFormat& format);
  Image(int width, int height, int channels, PixelType type)
      : Image(width, height, PixelFormat::usual(channels, type)) {}
  /// With these numbers, as laid out above.
  template <class Value>
  Image(int width, int height, int channels, std::span<const Value> values)
      : Image(width, height, channels, number_type_of<Value>()) {
    copy_from(std::as_bytes(values));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  const PixelFormat& format() const { return format_; }
  int channels() const { return format_.channels; }
  PixelType type() const { return format_.type; }
  double full() const { return format_.full; }
  bool empty() const { return bytes_.empty(); }
  bool has_alpha() const { return format_.has_alpha(); }
  std::size_t pixel_count() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }
  /// Bytes of a pixel.
  std::size_t pixel_size() const { return static_cast<std::size_t>(channels()) * byte_count(type()); }

  std::span<std::byte> bytes() { return bytes_; }
  std::span<const std::byte> bytes() const { return bytes_; }

  /// All numbers in order; Value must be that of type().
  template <class Value>
  std::span<Value> values() {
    assert(number_type_of<Value>() == type());
    return {reinterpret_cast<Value*>(bytes_.data()), bytes_.size() / sizeof(Value)};
  }
  template <class Value>
  std::span<const Value> values() const {
    assert(number_type_of<Value>() == type());
    return {reinterpret_cast<const Value*>(bytes_.data()), bytes_.size() / sizeof(Value)};
  }

  /// One number of one pixel, whatever the type; slow, and of 64-bit integers not exact.
  double at(int x, int y, int channel) const;

  /// Same size, format and bytes.
  friend bool operator==(const Image&, const Image&) = default;

 private:
  void copy_from(std::span<const std::byte> bytes);

  int width_ = 0;
  int height_ = 0;
  PixelFormat format_;
  std::vector<std::byte> bytes_;
};

/// The picture as it is displayed, of the one that is stored, by its EXIF or TIFF orientation: 1 is upright, 2 to 4 are
/// mirrored or turned by a half, 5 to 8 have rows for columns. Other numbers change nothing.
Image oriented(const Image& stored, int orientation);

/// The most pixels of an image unless more are asked for: twice a photograph of 100 megapixels. With alpha they take
/// 0.8 GB in 8 bits.
inline constexpr std::int64_t kMaxPixels = 200'000'000;

/// "… pixels, more than `max_pixels = …` allows": @throws InputError where width·height is more than max_pixels, before
/// anything is allocated. @param what has so many: "the image"
void check_pixel_count(std::int64_t width, std::int64_t height, std::int64_t max_pixels, const std::string& what);

/// The first page of a file as read_pages has it, for show: see shown(). @throws InputError as read_pages
Image read_image(const std::filesystem::path& path, std::int64_t max_pixels = kMaxPixels);

/// The same of the bytes of a file. @throws InputError as read_image, without a name
Image decode_image(std::string_view bytes, std::int64_t max_pixels = kMaxPixels);

/// One page with nothing beside its pixels: see write_pages. @throws InputError as write_pages
void write_image(const std::filesystem::path& path, const Image& image);

/// The bytes that write_image puts into a file of this extension, as ".png". @throws InputError as write_image
std::string encode_image(const Image& image, const std::string& extension);

/// Whether write_image knows the extension of `path`. For use before a long computation.
/// @throws InputError that lists the extensions if not
void check_image_extension(const std::filesystem::path& path);

}  // namespace pulson::images
