// The pages of a tif, by libtiff.

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

#include "codecs.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "tiff_file.hpp"

namespace pulson::images {
namespace {

/// The tags that say what the pixels are.
struct Layout {
  explicit Layout(TIFF* tif)
      : width(field<std::uint32_t>(tif, TIFFTAG_IMAGEWIDTH)),
        height(field<std::uint32_t>(tif, TIFFTAG_IMAGELENGTH)),
        bits(field<std::uint16_t>(tif, TIFFTAG_BITSPERSAMPLE)),
        samples(field<std::uint16_t>(tif, TIFFTAG_SAMPLESPERPIXEL)),
        format(field<std::uint16_t>(tif, TIFFTAG_SAMPLEFORMAT)),
        planar(field<std::uint16_t>(tif, TIFFTAG_PLANARCONFIG)),
        photometric(field<std::uint16_t>(tif, TIFFTAG_PHOTOMETRIC)) {
    std::uint16_t count = 0;
    const std::uint16_t* kinds = nullptr;
    // Four channels of colours of which nothing is said: programs show the fourth as alpha.
    const bool says = TIFFGetField(tif, TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1 && count > 0;
    if (says) extra.assign(kinds, kinds + count);
    if (!says && photometric == PHOTOMETRIC_RGB && samples == 4) extra = {EXTRASAMPLE_UNASSALPHA};
    const int more = samples - colours();
    const auto wanted = static_cast<std::size_t>(std::max(more, 0));
    if (extra.size() < wanted) extra.insert(extra.begin(), wanted - extra.size(), EXTRASAMPLE_UNSPECIFIED);
    extra.resize(wanted);
  }

  int colours() const {
    if (photometric == PHOTOMETRIC_RGB) return 3;
    return photometric == PHOTOMETRIC_SEPARATED ? 4 : 1;
  }

  /// Whether the numbers are those of the image. Else libtiff converts them to red, green and blue of 8 bits.
  bool is_direct() const {
    const bool is_known = photometric == PHOTOMETRIC_MINISWHITE || photometric == PHOTOMETRIC_MINISBLACK ||
                          photometric == PHOTOMETRIC_RGB || photometric == PHOTOMETRIC_SEPARATED ||
                          (photometric == PHOTOMETRIC_PALETTE && samples == 1 && bits <= 16);
    return is_known && samples >= colours();
  }

  std::optional<PixelType> type() const {
    using enum PixelType;
    if (format == SAMPLEFORMAT_IEEEFP)
      return bits == 32 ? std::optional(kFloat32) : (bits == 64 ? std::optional(kFloat64) : std::nullopt);
    const bool is_signed = format == SAMPLEFORMAT_INT;
    if (format != SAMPLEFORMAT_UINT && format != SAMPLEFORMAT_VOID && !is_signed) return std::nullopt;
    if (bits == 32) return is_signed ? kInt32 : kUint32;
    if (bits == 64) return is_signed ? kInt64 : kUint64;
    if (bits < 1 || bits > 16 || (is_signed && bits % 8 != 0)) return std::nullopt;
    if (bits <= 8) return is_signed ? kInt8 : kUint8;
    return is_signed ? kInt16 : kUint16;
  }

  PixelFormat pixels() const {
    PixelFormat pixels{samples, *type(), Alpha::kNone, full_value(*type())};
    if (bits < 16 && pixels.type != PixelType::kInt8) pixels.full = (1 << bits) - 1;
    if (!extra.empty() && extra.back() == EXTRASAMPLE_UNASSALPHA) pixels.alpha = Alpha::kStraight;
    if (!extra.empty() && extra.back() == EXTRASAMPLE_ASSOCALPHA) pixels.alpha = Alpha::kAssociated;
    return pixels;
  }

  std::uint32_t width, height;
  std::uint16_t bits, samples, format, planar, photometric;
  std::vector<std::uint16_t> extra;  ///< what the channels beside the colours are
};

void check_layout(const Layout& layout) {
  if (layout.photometric == PHOTOMETRIC_LOGLUV || layout.photometric == PHOTOMETRIC_LOGL)
    throw InputError("it is a tif in LogLuv colours, which is not read; save it with floating-point numbers");
  if (!layout.type())
    throw InputError("it is a tif of " + std::to_string(layout.bits) + "-bit " +
                     (layout.format == SAMPLEFORMAT_IEEEFP                                       ? "floating-point"
                      : layout.format == SAMPLEFORMAT_UINT || layout.format == SAMPLEFORMAT_VOID ? "whole"
                      : layout.format == SAMPLEFORMAT_INT                                        ? "signed"
                                                                                                 : "complex") +
                     " numbers, which are not read; it must be of whole numbers of 1 to 16, 32 or 64 bits, of signed "
                     "ones of 8, 16, 32 or 64, or of floating-point ones of 32 or 64");
}

/// `count` numbers of fewer than 16 bits, without gaps.
template <class Value>
void unpack(const unsigned char* from, std::size_t count, unsigned bits, Value* to) {
  const std::uint64_t mask = (1U << bits) - 1;
  std::uint64_t buffer = 0;
  unsigned filled = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (; filled < bits; filled += 8) buffer = buffer << 8U | *from++;
    filled -= bits;
    to[i] = static_cast<Value>(buffer >> filled & mask);
  }
}

/// Tiles or strips, which have some rows, of all channels or of one.
class DirectReader {
 public:
  DirectReader(TIFF* tif, const Layout& layout, std::int64_t max_pixels)
      : tif_(tif), layout_(layout), width_(layout.width) {
    is_tiled_ = TIFFIsTiled(tif) != 0;
    if (is_tiled_) width_ = field<std::uint32_t>(tif, TIFFTAG_TILEWIDTH);
    height_ = is_tiled_ ? field<std::uint32_t>(tif, TIFFTAG_TILELENGTH)
                        : std::min(layout.height, field<std::uint32_t>(tif, TIFFTAG_ROWSPERSTRIP));
    check_size(width_, height_, max_pixels);
    const tmsize_t size = is_tiled_ ? TIFFTileSize(tif) : TIFFStripSize(tif);
    is_parted_ = layout.planar == PLANARCONFIG_SEPARATE && layout.samples > 1;
    in_chunk_ = is_parted_ ? 1U : layout.samples;
    row_size_ = (static_cast<std::size_t>(width_) * in_chunk_ * layout.bits + 7) / 8;
    if (size <= 0 || static_cast<std::size_t>(size) < row_size_ * height_) fail_as_damaged();
    chunk_.resize(static_cast<std::size_t>(size));
  }

  Image read(std::int64_t max_pixels) {
    Image image = new_image(layout_.width, layout_.height, layout_.pixels(), max_pixels);
    for (std::uint32_t plane = 0; plane < (is_parted_ ? layout_.samples : 1U); ++plane)
      for (std::uint32_t y = 0; y < layout_.height; y += height_)
        for (std::uint32_t x = 0; x < layout_.width; x += width_) {
          read_chunk(x, y, plane);
          for (std::uint32_t i = 0; i < std::min(height_, layout_.height - y); ++i)
            copy_row(chunk_.data() + i * row_size_, image, x, y + i, plane);
        }
    return image;
  }

 private:
  void read_chunk(std::uint32_t x, std::uint32_t y, std::uint32_t plane) {
    const auto part = static_cast<std::uint16_t>(plane);
    const auto size = static_cast<tmsize_t>(chunk_.size());
    const tmsize_t read = is_tiled_
                              ? TIFFReadEncodedTile(tif_, TIFFComputeTile(tif_, x, y, 0, part), chunk_.data(), size)
                              : TIFFReadEncodedStrip(tif_, TIFFComputeStrip(tif_, y, part), chunk_.data(), size);
    if (read < 0) fail_as_damaged();
  }

  void copy_row(const unsigned char* from, Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t plane) {
    const std::size_t count = std::min(width_, layout_.width - x), size = byte_count(image.type());
    if (layout_.bits % 8 != 0) {
      unpacked_.resize(count * in_chunk_ * size);
      if (size == 1)
        unpack(from, count * in_chunk_, layout_.bits, unpacked_.data());
      else
        unpack(from, count * in_chunk_, layout_.bits, reinterpret_cast<std::uint16_t*>(unpacked_.data()));
      from = unpacked_.data();
    }
    unsigned char* to = row(image, static_cast<int>(y)) + (x * std::size_t{layout_.samples} + plane) * size;
    if (!is_parted_)
      std::memcpy(to, from, count * in_chunk_ * size);
    else
      for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * layout_.samples * size, from + i * size, size);
  }

  TIFF* tif_;
  const Layout& layout_;
  std::uint32_t width_, height_ = 0;  ///< of a tile or strip
  bool is_tiled_ = false, is_parted_ = false;
  std::size_t in_chunk_ = 0;  ///< channels
  std::size_t row_size_ = 0;
  std::vector<unsigned char> chunk_;
  std::vector<unsigned char> unpacked_;
};

/// By libtiff's conversion to red, green and blue.
Image read_converted(TIFF* tif, const Layout& layout, std::int64_t max_pixels) {
  Image image = new_image(layout.width, layout.height, {.channels = 3}, max_pixels);
  std::vector<std::uint32_t> pixels(image.pixel_count());
  // Rows in the order of the file: they are not turned.
  if (TIFFReadRGBAImageOriented(tif, layout.width, layout.height, pixels.data(),
                                field<std::uint16_t>(tif, TIFFTAG_ORIENTATION), 1) == 0)
    fail_as_damaged();
  auto value = image.values<std::uint8_t>().begin();
  for (const std::uint32_t pixel : pixels)
    for (int c = 0; c < 3; ++c) *value++ = static_cast<std::uint8_t>(pixel >> (8 * c));
  return image;
}

void read_palette(TIFF* tif, const Layout& layout, PageMetadata& about) {
  const std::uint16_t *red = nullptr, *green = nullptr, *blue = nullptr;
  if (TIFFGetField(tif, TIFFTAG_COLORMAP, &red, &green, &blue) != 1) fail_as_damaged();
  for (std::size_t i = 0; i < std::size_t{1} << layout.bits; ++i)
    about.palette.push_back({red[i], green[i], blue[i], 0xFFFF});
}

Page read_page(TIFF* tif, const Layout& layout, std::int64_t max_pixels) {
  Page page;
  read_tags(tif, page.about);
  if (!layout.is_direct()) {
    page.image = read_converted(tif, layout, max_pixels);
    page.about.profile.clear();  // it is of the colours before
    return page;
  }
  page.image = DirectReader(tif, layout, max_pixels).read(max_pixels);
  if (layout.photometric == PHOTOMETRIC_PALETTE) read_palette(tif, layout, page.about);
  page.about.white_is_zero = layout.photometric == PHOTOMETRIC_MINISWHITE;
  page.about.is_cmyk = layout.photometric == PHOTOMETRIC_SEPARATED;
  page.about.extra_samples = layout.extra;
  return page;
}

/// ImageJ lists one page of a stack that is longer than tif allows, and says in words how many follow.
void check_imagej_stack(const PictureFile& file) {
  const std::string& text = file.pages.front().about.description;
  constexpr std::string_view kCount = "\nimages=";
  const std::size_t at = text.find(kCount);
  if (!text.starts_with("ImageJ=") || at == std::string::npos || file.pages.size() > 1) return;
  const std::size_t count = std::strtoul(text.c_str() + at + kCount.size(), nullptr, 10);
  if (count > 1)
    throw InputError("it is a stack of ImageJ of " + std::to_string(count) +
                     " pictures, of which the tif lists one; save it in parts of less than 4 GB, or by Bio-Formats");
}

}  // namespace

PictureFile decode_tiff(std::string_view bytes, std::int64_t max_pixels) {
  constexpr std::int64_t kMostBytesOfPixel = 16, kMostPixels = 1LL << 30;
  constexpr tmsize_t kTables = tmsize_t{1} << 20;  // LZW's take 0.1 MB
  const auto most =
      std::max<tmsize_t>({std::ssize(bytes), kTables, kMostBytesOfPixel * std::min(max_pixels, kMostPixels)});
  MemoryFile file{bytes, {}};
  const Tiff tif = open_tiff(file, "rm", most);
  if (!tif) fail_as_damaged();
  PictureFile result;
  std::int64_t left = max_pixels;
  int smaller = 0, converted = 0;
  do {
    const bool is_smaller = (field<std::uint32_t>(tif.get(), TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE) != 0;
    if (is_smaller && !result.pages.empty()) {
      ++smaller;
      continue;
    }
    const Layout layout(tif.get());
    check_layout(layout);
    check_size(layout.width, layout.height, max_pixels);
    const std::int64_t pixels = std::int64_t{layout.width} * layout.height;
    if (pixels > left)
      throw InputError("its first " + text::counted(result.pages.size() + 1, "page") + " have " +
                       std::to_string(max_pixels - left + pixels) +
                       " pixels, more than `max_pixels = " + std::to_string(max_pixels) + "` allows");
    converted += layout.is_direct() ? 0 : 1;
    result.pages.push_back(read_page(tif.get(), layout, left));
    left -= pixels;
  } while (TIFFReadDirectory(tif.get()) == 1);
  check_imagej_stack(result);
  if (smaller > 0)
    result.notes.push_back("of pages that are smaller copies of others (" + std::to_string(smaller) +
                           "), none was taken");
  if (converted > 0) result.notes.emplace_back("its colours were converted to red, green and blue of 8 bits");
  return result;
}

}  // namespace pulson::images
