// Pages written as a tif, by libtiff.

#include <algorithm>
#include <cstring>
#include <iterator>
#include <vector>

#include "codecs.hpp"
#include "tiff_file.hpp"

namespace pulson::images {
namespace {

/// Kinds of the channels beside the colours, as the picture had them or as is usual: after red, green and blue, inks or
/// one channel.
std::vector<std::uint16_t> extra_samples(const Page& page) {
  const PixelFormat& format = page.image.format();
  std::vector<std::uint16_t> kinds = page.about.extra_samples;
  const std::uint16_t alpha = format.alpha == Alpha::kStraight ? EXTRASAMPLE_UNASSALPHA : EXTRASAMPLE_ASSOCALPHA;
  if (kinds.empty()) {
    const int usual = page.about.is_cmyk ? 4 : (format.colours() == 3 ? 3 : 1);
    kinds.resize(static_cast<std::size_t>(format.channels - usual), EXTRASAMPLE_UNSPECIFIED);
    if (format.has_alpha()) kinds.back() = alpha;
  } else if (format.has_alpha() && kinds.back() != alpha) {
    kinds.push_back(alpha);  // the warp needed it
  }
  return kinds;
}

std::uint16_t photometric(const Page& page, std::size_t colours) {
  if (page.about.has_palette()) return PHOTOMETRIC_PALETTE;
  if (page.about.is_cmyk) return PHOTOMETRIC_SEPARATED;
  if (colours == 3) return PHOTOMETRIC_RGB;
  return page.about.white_is_zero ? PHOTOMETRIC_MINISWHITE : PHOTOMETRIC_MINISBLACK;
}

/// That of the file, where it loses nothing and libtiff always has it.
int lossless_compression(const PageMetadata& about) {
  constexpr int kKept[] = {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE,
                           COMPRESSION_PACKBITS};
  const bool is_kept = std::find(std::begin(kKept), std::end(kKept), about.compression) != std::end(kKept);
  return is_kept ? about.compression : COMPRESSION_LZW;
}

void set_palette(TIFF* tif, const Page& page, int bits) {
  std::vector<std::uint16_t> parts[3];
  for (std::size_t c = 0; c < 3; ++c) {
    for (const auto& colour : page.about.palette) parts[c].push_back(colour[c]);
    parts[c].resize(std::size_t{1} << static_cast<unsigned>(bits));
  }
  TIFFSetField(tif, TIFFTAG_COLORMAP, parts[0].data(), parts[1].data(), parts[2].data());
}

bool has_planes(const Page& page) { return page.about.has_planes && page.image.channels() > 1; }

void set_layout(TIFF* tif, const Page& page, int bits) {
  const Image& image = page.image;
  const bool is_float = is_floating_point(image.type());
  const std::vector<std::uint16_t> extra = extra_samples(page);
  TIFFSetField(tif, TIFFTAG_IMAGEWIDTH, image.width());
  TIFFSetField(tif, TIFFTAG_IMAGELENGTH, image.height());
  TIFFSetField(tif, TIFFTAG_BITSPERSAMPLE, bits);
  TIFFSetField(tif, TIFFTAG_SAMPLESPERPIXEL, image.channels());
  TIFFSetField(tif, TIFFTAG_SAMPLEFORMAT,
               is_float ? SAMPLEFORMAT_IEEEFP : (is_signed(image.type()) ? SAMPLEFORMAT_INT : SAMPLEFORMAT_UINT));
  TIFFSetField(tif, TIFFTAG_PHOTOMETRIC, photometric(page, static_cast<std::size_t>(image.channels()) - extra.size()));
  if (page.about.has_palette()) set_palette(tif, page, bits);
  TIFFSetField(tif, TIFFTAG_PLANARCONFIG, has_planes(page) ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
  const int compression = lossless_compression(page.about);
  TIFFSetField(tif, TIFFTAG_COMPRESSION, compression);
  const bool is_predicted = compression != COMPRESSION_NONE && compression != COMPRESSION_PACKBITS;
  if (is_predicted && !is_float && (bits == 8 || bits == 16))
    TIFFSetField(tif, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tif, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tif, 0));
  if (!extra.empty()) TIFFSetField(tif, TIFFTAG_EXTRASAMPLES, static_cast<int>(extra.size()), extra.data());
}

/// Numbers of fewer bits than their type has, without gaps but for the last byte.
template <class Value>
void pack(const Value* from, std::size_t count, unsigned bits, std::vector<unsigned char>& to) {
  std::uint64_t buffer = 0;
  unsigned filled = 0;
  for (std::size_t i = 0; i < count; ++i) {
    buffer = buffer << bits | from[i];
    for (filled += bits; filled >= 8; filled -= 8) to.push_back(static_cast<unsigned char>(buffer >> (filled - 8)));
  }
  if (filled > 0) to.push_back(static_cast<unsigned char>(buffer << (8 - filled)));
}

/// Of the numbers of a row those of one channel.
void keep_channel(const Image& image, int channel, std::vector<unsigned char>& numbers) {
  const std::size_t size = byte_count(image.type()), stride = image.pixel_size();
  const std::size_t first = static_cast<std::size_t>(channel) * size;
  const auto width = static_cast<std::size_t>(image.width());
  for (std::size_t x = 0; x < width; ++x) std::memmove(&numbers[x * size], &numbers[x * stride + first], size);
  numbers.resize(width * size);
}

bool write_page(TIFF* tif, const Page& page) {
  const Image& image = page.image;
  const int own = static_cast<int>(8 * byte_count(image.type()));
  const int fewer = is_signed(image.type()) || own > 16 ? own : bits_of(image.format());
  const int bits = fewer > 0 ? fewer : own;
  set_layout(tif, page, bits);
  write_tags(tif, page.about);
  const int planes = has_planes(page) ? image.channels() : 1;
  std::vector<unsigned char> numbers, line;
  for (int plane = 0; plane < planes; ++plane)
    for (int y = 0; y < image.height(); ++y) {
      numbers.assign(row(image, y), row(image, y) + row_size(image));
      if (planes > 1) keep_channel(image, plane, numbers);
      line.clear();  // libtiff changes it
      const std::size_t count = numbers.size() / byte_count(image.type());
      if (bits == own)
        line = numbers;
      else if (own == 8)
        pack(numbers.data(), count, static_cast<unsigned>(bits), line);
      else
        pack(reinterpret_cast<const std::uint16_t*>(numbers.data()), count, static_cast<unsigned>(bits), line);
      if (TIFFWriteScanline(tif, line.data(), static_cast<std::uint32_t>(y), static_cast<std::uint16_t>(plane)) != 1)
        return false;
    }
  return TIFFWriteDirectory(tif) == 1;
}

}  // namespace

std::string encode_tiff(std::span<const Page> pages) {
  constexpr std::size_t kMostOfClassic = std::size_t{3} << 30U;  // of 4 GiB, with room for what LZW adds to noise
  std::size_t size = 0;
  for (const Page& page : pages) size += page.image.bytes().size();
  MemoryFile file;
  const Tiff tif = open_tiff(file, size > kMostOfClassic ? "w8" : "w");
  for (const Page& page : pages)
    if (!tif || !write_page(tif.get(), page)) return "";
  return TIFFFlush(tif.get()) == 1 ? file.written : "";
}

}  // namespace pulson::images
