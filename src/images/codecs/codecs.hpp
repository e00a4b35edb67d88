#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pulson/images/image.hpp"

namespace pulson::images {

// The formats of image files, one pair of functions each. `bytes` is a whole file that begins with the format's
// signature. Every decode_ throws InputError for a file that is damaged or cut off, or whose image is too large, before
// it allocates anything of the size that the file claims; the message does not name the file. Every encode_ takes an
// image without fully checking it: image.cpp asks for what the format holds, and for 1, 3 or 4 channels. An encode_
// returns an empty string for sizes that the format does not take. None prints anything. Thread-safe.

/// Bit depths below 8 become 8. A palette becomes red, green and blue, with alpha where it has transparent colours;
/// grey with alpha becomes four channels.
Image decode_png(std::string_view bytes, std::int64_t max_pixels);
/// Compressed for speed: Sub filter, run lengths.
std::string encode_png(const Image& image);

/// Grey, or red, green and blue, also from CMYK. EXIF orientation is not applied.
Image decode_jpeg(std::string_view bytes, std::int64_t max_pixels);
/// Quality 95.
std::string encode_jpeg(const Image& image);

/// The first page, turned as its orientation tag says. Unsigned integers of 8 and 16 bits and floating-point numbers of
/// 32; 10, 12 and 14 bits become 16; other integers and all other colour spaces become 8. Alpha is straight.
Image decode_tiff(std::string_view bytes, std::int64_t max_pixels);
/// By LZW.
std::string encode_tiff(const Image& image);

/// All of Windows and OS/2 1.x: 1 to 32 bits, run lengths, bit fields. A palette of greys gives one channel.
Image decode_bmp(std::string_view bytes, std::int64_t max_pixels);
/// 24 bits, or 8 with a palette of greys.
std::string encode_bmp(const Image& image);

/// pbm, pgm and ppm, as text or binary (P1 to P6), values scaled from the file's highest to 255 or 65535.
Image decode_pnm(std::string_view bytes, std::int64_t max_pixels);
/// P5 or P6.
std::string encode_pnm(const Image& image);

/// @throws InputError "the image is damaged or cut off"
[[noreturn]] void fail_as_damaged();

/// @throws InputError unless sides are 1 to 2^20, and pixels at most 2^30 and `max_pixels`
void check_size(std::int64_t width, std::int64_t height, std::int64_t max_pixels);

/// An image of zeros. @throws InputError as check_size does
Image new_image(std::int64_t width, std::int64_t height, int channels, PixelDepth depth, std::int64_t max_pixels);

/// Row y, of row_size() bytes.
inline std::size_t row_size(const Image& image) {
  return image.bytes().size() / static_cast<std::size_t>(image.height());
}
inline unsigned char* row(Image& image, int y) {
  return reinterpret_cast<unsigned char*>(image.bytes().data()) + static_cast<std::size_t>(y) * row_size(image);
}
inline const unsigned char* row(const Image& image, int y) { return row(const_cast<Image&>(image), y); }

}  // namespace pulson::images
