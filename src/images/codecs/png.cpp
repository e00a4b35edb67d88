// By libpng, which leaves a function on errors by longjmp: those that call setjmp have no objects with destructors.

#include <bit>
#include <csetjmp>
#include <cstring>
#include <vector>

#include <png.h>
#include <zlib.h>

#include "codecs.hpp"

namespace pulson::images {
namespace {

struct PngReader {
  png_structp png;
  png_infop info;
  explicit PngReader(std::string_view& bytes);
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
};

struct PngWriter {
  png_structp png;
  png_infop info;
  explicit PngWriter(std::string& bytes);
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
};

[[noreturn]] void leave(png_structp png, png_const_charp /*message*/) { png_longjmp(png, 1); }

void ignore(png_structp /*png*/, png_const_charp /*message*/) {}

void take(png_structp png, png_bytep to, std::size_t count) {
  auto& rest = *static_cast<std::string_view*>(png_get_io_ptr(png));
  if (count > rest.size()) png_error(png, "end of file");
  std::memcpy(to, rest.data(), count);
  rest.remove_prefix(count);
}

void append(png_structp png, png_bytep from, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(from), count);
}

PngReader::PngReader(std::string_view& bytes)
    : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, ignore)), info(png_create_info_struct(png)) {
  png_set_read_fn(png, &bytes, take);
}

PngWriter::PngWriter(std::string& bytes)
    : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, leave, ignore)), info(png_create_info_struct(png)) {
  png_set_write_fn(png, &bytes, append, [](png_structp) {});
}

/// Reads what comes before the pixels. False for a damaged file. Texts and profiles, which may be compressed a
/// thousandfold, are passed over.
bool read_header(PngReader& reader) {
  const png_structp png = reader.png;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  constexpr int kAllThatImagesDoWithout = -1;
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, kAllThatImagesDoWithout);
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_read_info(png, reader.info);
  return true;
}

/// Asks for the form of the pixels, and makes room for rows.
bool prepare_rows(PngReader& reader) {
  const png_structp png = reader.png;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  const int type = png_get_color_type(png, reader.info);
  const bool has_colour = (type & PNG_COLOR_MASK_COLOR) != 0;
  if (std::endian::native == std::endian::little) png_set_swap(png);
  if (type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (has_colour) png_set_tRNS_to_alpha(png);
  if (type == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png);
  if (type == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, reader.info);
  return true;
}

bool read_pixels(PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

int colour_type(const Image& image) {
  if (image.channels() == 1) return PNG_COLOR_TYPE_GRAY;
  return image.has_alpha() ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB;
}

bool write_all(PngWriter& writer, const Image& image, png_bytepp rows) {
  const png_structp png = writer.png;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_IHDR(png, writer.info, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(image.height()),
               8 * static_cast<int>(byte_count(image.depth())), colour_type(image), PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_write_info(png, writer.info);
  if (std::endian::native == std::endian::little) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, writer.info);
  return true;
}

std::vector<png_bytep> row_pointers(Image& image) {
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(row(image, y));
  return rows;
}

}  // namespace

Image decode_png(std::string_view bytes, std::int64_t max_pixels) {
  PngReader reader(bytes);
  if (!read_header(reader)) fail_as_damaged();
  const png_uint_32 width = png_get_image_width(reader.png, reader.info);
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  check_size(width, height, max_pixels);
  if (!prepare_rows(reader)) fail_as_damaged();
  const PixelDepth depth = png_get_bit_depth(reader.png, reader.info) == 16 ? PixelDepth::kUint16 : PixelDepth::kUint8;
  Image image = new_image(width, height, png_get_channels(reader.png, reader.info), depth, max_pixels);
  if (!read_pixels(reader, row_pointers(image).data())) fail_as_damaged();
  return image;
}

std::string encode_png(const Image& image) {
  std::string bytes;
  PngWriter writer(bytes);
  // libpng takes pointers to mutable rows, and reads them.
  return write_all(writer, image, row_pointers(const_cast<Image&>(image)).data()) ? bytes : "";
}

}  // namespace pulson::images
