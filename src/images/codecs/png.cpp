// By libpng, which leaves a function on errors by longjmp: those that call setjmp have no objects with destructors.

#include <bit>
#include <csetjmp>
#include <cstring>
#include <vector>

#include <png.h>
#include <zlib.h>

#include "codecs.hpp"
#include "png_chunks.hpp"

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
/// thousandfold, are passed over: see png_chunks.hpp.
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
  if (std::endian::native == std::endian::little) png_set_swap(png);
  png_set_packing(png);  // out of bytes: each number has its own
  // It also spreads few bits over eight.
  if (type != PNG_COLOR_TYPE_PALETTE && png_get_valid(png, reader.info, PNG_INFO_tRNS) != 0) png_set_tRNS_to_alpha(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, reader.info);
  return true;
}

/// The colours of the file.
void read_palette(const PngReader& reader, PageMetadata& about) {
  constexpr unsigned kTo16Bits = 257;
  png_colorp colours = nullptr;
  png_bytep opacities = nullptr;
  int count = 0, transparent = 0;
  png_get_PLTE(reader.png, reader.info, &colours, &count);
  png_get_tRNS(reader.png, reader.info, &opacities, &transparent, nullptr);
  const auto wide = [](unsigned value) { return static_cast<std::uint16_t>(kTo16Bits * value); };
  for (int i = 0; i < count; ++i)
    about.palette.push_back({wide(colours[i].red), wide(colours[i].green), wide(colours[i].blue),
                             wide(opacities != nullptr && i < transparent ? opacities[i] : 255U)});
}

bool read_pixels(PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

int colour_type(const Page& page) {
  if (page.about.has_palette()) return PNG_COLOR_TYPE_PALETTE;
  const bool has_alpha = page.image.has_alpha();
  if (page.image.format().colours() == 1) return has_alpha ? PNG_COLOR_TYPE_GRAY_ALPHA : PNG_COLOR_TYPE_GRAY;
  return has_alpha ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB;
}

struct PngPalette {
  png_color colours[256];
  png_byte opacities[256];
  int count = 0, transparent = 0;

  explicit PngPalette(const PageMetadata& about) {
    constexpr unsigned kTo16Bits = 257;
    for (const auto& colour : about.palette) {
      png_byte bytes[4];
      for (std::size_t c = 0; c < 4; ++c) bytes[c] = static_cast<png_byte>((colour[c] + kTo16Bits / 2) / kTo16Bits);
      colours[count] = {bytes[0], bytes[1], bytes[2]};
      opacities[count++] = bytes[3];
      if (bytes[3] < 255) transparent = count;
    }
  }
};

bool write_all(PngWriter& writer, const Page& page, const PngPalette& palette, png_bytepp rows) {
  const png_structp png = writer.png;
  const Image& image = page.image;
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_set_IHDR(png, writer.info, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(image.height()),
               bits_of(image.format()), colour_type(page), PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (palette.count > 0) png_set_PLTE(png, writer.info, palette.colours, palette.count);
  if (palette.transparent > 0) png_set_tRNS(png, writer.info, palette.opacities, palette.transparent, nullptr);
  png_set_check_for_invalid_index(png, 0);  // numbers without a colour are kept
  png_set_filter(png, PNG_FILTER_TYPE_BASE, palette.count > 0 ? PNG_FILTER_NONE : PNG_FILTER_SUB);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_write_info(png, writer.info);
  if (std::endian::native == std::endian::little) png_set_swap(png);
  png_set_packing(png);
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

PictureFile decode_png(std::string_view bytes, std::int64_t max_pixels) {
  const std::string_view whole = bytes;
  PngReader reader(bytes);
  if (!read_header(reader)) fail_as_damaged();
  const png_uint_32 width = png_get_image_width(reader.png, reader.info);
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  check_size(width, height, max_pixels);
  const int bits = png_get_bit_depth(reader.png, reader.info);
  const bool has_palette = png_get_color_type(reader.png, reader.info) == PNG_COLOR_TYPE_PALETTE;
  if (!prepare_rows(reader)) fail_as_damaged();
  const int depth = png_get_bit_depth(reader.png, reader.info);  // 8 or 16
  PixelFormat format = PixelFormat::usual(png_get_channels(reader.png, reader.info),
                                          depth == 16 ? PixelType::kUint16 : PixelType::kUint8);
  if (format.channels == 1) format.full = (1 << bits) - 1;
  PictureFile file;
  Page& page = file.pages.emplace_back();
  page.about = metadata_of_png(whole);
  if (has_palette) read_palette(reader, page.about);
  page.image = new_image(width, height, format, max_pixels);
  if (!read_pixels(reader, row_pointers(page.image).data())) fail_as_damaged();
  return file;
}

std::string encode_png(std::span<const Page> pages) {
  const Page& page = pages.front();
  std::string bytes;
  PngWriter writer(bytes);
  const PngPalette palette(page.about);
  // libpng takes pointers to mutable rows, and reads them.
  if (!write_all(writer, page, palette, row_pointers(const_cast<Image&>(page.image)).data())) return "";
  constexpr std::size_t kSignatureAndHeader = 8 + 25;
  return bytes.insert(kSignatureAndHeader, chunks_of(page.about));
}

}  // namespace pulson::images
