#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "pulson/images/pages.hpp"

namespace pulson::images {

// The formats of image files, one pair of functions each. `bytes` is a whole file that begins with the format's
// signature. Every decode_ throws InputError for a file that is damaged or cut off, or whose image is too large, before
// it allocates anything of the size that the file claims; the message does not name the file. Every encode_ takes pages
// without fully checking them: picture_formats.cpp asks for what the format holds, and for one page but for tif. An
// encode_ returns an empty string for sizes that the format does not take. None prints anything. Thread-safe.

/// Numbers as they are, those of a palette too, but for one colour that is said to be transparent, which becomes alpha.
/// Texts and what is said of colours is copied as it is in the file.
PictureFile decode_png(std::string_view bytes, std::int64_t max_pixels);
/// Compressed for speed: Sub filter, run lengths.
std::string encode_png(std::span<const Page> pages);

/// Grey, or red, green and blue, also from CMYK.
PictureFile decode_jpeg(std::string_view bytes, std::int64_t max_pixels);
/// Quality 95.
std::string encode_jpeg(std::span<const Page> pages);

/// All pages, numbers as they are: whole ones of 1 to 16, 32 and 64 bits, signed from 8 bits on, and floating-point
/// ones of 32 and 64. Colours other than grey, palette, red, green and blue, and inks become red, green and blue of 8
/// bits.
PictureFile decode_tiff(std::string_view bytes, std::int64_t max_pixels);
/// By LZW.
std::string encode_tiff(std::span<const Page> pages);

/// All of Windows and OS/2 1.x: 1 to 32 bits, run lengths, bit fields. An even palette of greys gives grey.
PictureFile decode_bmp(std::string_view bytes, std::int64_t max_pixels);

/// pbm, pgm and ppm, as text or binary (P1 to P6). The highest value is the file's where it is 2^bits − 1; other
/// numbers are scaled to the range of their type, with a note.
PictureFile decode_pnm(std::string_view bytes, std::int64_t max_pixels);

/// @throws InputError "the image is damaged or cut off"
[[noreturn]] void fail_as_damaged();

/// @throws InputError unless sides are 1 to 2^20, and pixels at most 2^30 and `max_pixels`
void check_size(std::int64_t width, std::int64_t height, std::int64_t max_pixels);

/// An image of zeros. @throws InputError as check_size does, and where the numbers take more than 16 bytes for each of
/// max_pixels
Image new_image(std::int64_t width, std::int64_t height, const PixelFormat& format, std::int64_t max_pixels);

/// Bits of the numbers of an image of whole numbers whose highest is 2^bits − 1; 0 where there is no such number, or
/// the numbers are not of the type for it.
int bits_of(const PixelFormat& format);

/// Row y, of row_size() bytes.
inline std::size_t row_size(const Image& image) {
  return image.bytes().size() / static_cast<std::size_t>(image.height());
}
inline unsigned char* row(Image& image, int y) {
  return reinterpret_cast<unsigned char*>(image.bytes().data()) + static_cast<std::size_t>(y) * row_size(image);
}
inline const unsigned char* row(const Image& image, int y) { return row(const_cast<Image&>(image), y); }

}  // namespace pulson::images
