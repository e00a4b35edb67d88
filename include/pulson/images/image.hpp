#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace pulson::images {

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

/// The most pixels of an image unless more are asked for: twice a photograph of 100 megapixels. With alpha they take
/// 0.8 GB in 8 bits.
inline constexpr std::int64_t kMaxPixels = 200'000'000;

/// "… pixels, more than `max_pixels = …` allows": @throws InputError where width·height is more than max_pixels, before
/// anything is allocated. @param what has so many: "the image"
void check_pixel_count(std::int64_t width, std::int64_t height, std::int64_t max_pixels, const std::string& what);

/// The image in a file of format png, jpg, tif (its first page), bmp, pgm or ppm, recognised by its contents, not its
/// name. Depth and channels are those of the file: grey stays one channel, a palette becomes red, green and blue, grey
/// with alpha four channels, fewer than 8 bits become 8, and alpha is straight also where a tif multiplied it in. The
/// orientation in a jpg's EXIF data is not applied, so the pixels are where landmarks were placed on them.
/// Values of a pgm or ppm are scaled from the file's highest to 255 or 65535, those of a tif of 10, 12 or 14 bits
/// to 16. An image of more pixels than `max_pixels` is refused by what its header says, before it is decoded.
/// @throws InputError if the file is missing, no regular file, not an image, truncated, larger than 2^20 pixels on a
/// side, 2^30 or `max_pixels` in all, or of pixels that Image cannot hold (64-bit, signed)
Image read_image(const std::filesystem::path& path, std::int64_t max_pixels = kMaxPixels);

/// The same of the bytes of a file. @throws InputError as read_image, without a name
Image decode_image(std::string_view bytes, std::int64_t max_pixels = kMaxPixels);

/// Writes an image in the format of the extension: .png (8 or 16 bits, alpha), .tif or .tiff (also float; alpha), .jpg
/// or .jpeg (8 bits, quality 95), .bmp (8 bits), .pgm (grey, 8 or 16 bits), .ppm (colour, 8 or 16 bits). Two channels
/// are written as four. The file holds all or what it held before. @throws InputError for another extension, for an
/// image the format cannot hold (names those that can), or if the file cannot be written
void write_image(const std::filesystem::path& path, const Image& image);

/// The bytes that write_image puts into a file of this extension, as ".png". @throws InputError as write_image
std::string encode_image(const Image& image, const std::string& extension);

/// Whether write_image knows the extension of `path`. For use before a long computation.
/// @throws InputError that lists the extensions if not
void check_image_extension(const std::filesystem::path& path);

}  // namespace pulson::images
