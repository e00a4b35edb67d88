// By libtiff, which takes a file in memory as functions that read, write and seek.

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include <tiffio.h>

#include "../channels.hpp"
#include "codecs.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {
namespace {

/// What is read, or is being written.
struct MemoryFile {
  std::string_view bytes;
  std::string written;
  std::size_t position = 0;

  std::size_t size() const { return std::max(bytes.size(), written.size()); }
};

MemoryFile& file_of(thandle_t handle) { return *static_cast<MemoryFile*>(handle); }

tmsize_t read_part(thandle_t handle, void* to, tmsize_t count) {
  MemoryFile& file = file_of(handle);
  const std::size_t start = std::min(file.position, file.size());
  const std::size_t taken = std::min(static_cast<std::size_t>(count), file.size() - start);
  std::memcpy(to, (file.written.empty() ? file.bytes.data() : file.written.data()) + start, taken);
  file.position = start + taken;
  return static_cast<tmsize_t>(taken);
}

tmsize_t write_part(thandle_t handle, void* from, tmsize_t count) {
  MemoryFile& file = file_of(handle);
  const auto size = static_cast<std::size_t>(count);
  file.written.resize(std::max(file.written.size(), file.position + size));
  std::memcpy(file.written.data() + file.position, from, size);
  file.position += size;
  return count;
}

toff_t seek_part(thandle_t handle, toff_t offset, int origin) {
  MemoryFile& file = file_of(handle);
  if (origin == SEEK_CUR) offset += file.position;
  if (origin == SEEK_END) offset += file.size();
  file.position = static_cast<std::size_t>(offset);
  return offset;
}

int close_file(thandle_t /*handle*/) { return 0; }

toff_t size_of_file(thandle_t handle) { return file_of(handle).size(); }

/// Nothing is printed.
int ignore(TIFF* /*tif*/, void* /*data*/, const char* /*module*/, const char* /*format*/, va_list /*values*/) {
  return 1;
}

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

/// @param most bytes of a block that libtiff allocates for what the file claims; 0: no limit
Tiff open_tiff(MemoryFile& file, const char* mode, tmsize_t most = 0) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), ignore, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), most);
  return {TIFFClientOpenExt("", mode, &file, read_part, write_part, seek_part, close_file, size_of_file, nullptr,
                            nullptr, options.get()),
          &TIFFClose};
}

template <class Value>
Value field(TIFF* tif, unsigned tag) {
  Value value{};
  TIFFGetFieldDefaulted(tif, tag, &value);
  return value;
}

/// The tags that say what the pixels are.
struct Layout {
  explicit Layout(TIFF* tif)
      : width(field<std::uint32_t>(tif, TIFFTAG_IMAGEWIDTH)),
        height(field<std::uint32_t>(tif, TIFFTAG_IMAGELENGTH)),
        bits(field<std::uint16_t>(tif, TIFFTAG_BITSPERSAMPLE)),
        samples(field<std::uint16_t>(tif, TIFFTAG_SAMPLESPERPIXEL)),
        format(field<std::uint16_t>(tif, TIFFTAG_SAMPLEFORMAT)),
        planar(field<std::uint16_t>(tif, TIFFTAG_PLANARCONFIG)),
        photometric(field<std::uint16_t>(tif, TIFFTAG_PHOTOMETRIC)),
        orientation(field<std::uint16_t>(tif, TIFFTAG_ORIENTATION)) {
    std::uint16_t count = 0;
    const std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tif, TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1 && count > 0) extra = kinds[0];
  }

  bool is_grey() const { return photometric == PHOTOMETRIC_MINISWHITE || photometric == PHOTOMETRIC_MINISBLACK; }
  /// Whether the numbers are those of the image, but for white as 0. Else libtiff converts them to 8 bits.
  bool is_direct() const {
    const bool is_whole = bits == 8 || bits == 10 || bits == 12 || bits == 14 || bits == 16;
    // Some programs call three channels grey; of 8 bits libtiff then takes the first.
    const bool has_colours = (samples == 3 || samples == 4) &&
                             (photometric == PHOTOMETRIC_RGB || (photometric == PHOTOMETRIC_MINISBLACK && bits > 8));
    return ((is_grey() && samples <= 2) || has_colours) && (is_whole || bits == 32);
  }

  std::uint32_t width, height;
  std::uint16_t bits, samples, format, planar, photometric, orientation;
  std::uint16_t extra = EXTRASAMPLE_UNSPECIFIED;  ///< what a channel beside the colours is
};

void check_layout(const Layout& layout) {
  if (layout.photometric == PHOTOMETRIC_LOGLUV || layout.photometric == PHOTOMETRIC_LOGL)
    throw InputError("it is a tif in LogLuv colours, which is not read; save it with floating-point numbers");
  if (layout.is_grey() && layout.samples == 2 && layout.extra == EXTRASAMPLE_UNSPECIFIED)
    throw InputError("it is a tif of two channels, of which the second is not alpha; save each as an image");
  const bool is_float = layout.format == SAMPLEFORMAT_IEEEFP;
  if (layout.bits > 32 || (layout.format != SAMPLEFORMAT_UINT && !is_float) || is_float != (layout.bits == 32))
    throw InputError(
        "its pixels are signed or of 64 bits; they must be unsigned of 8 or 16 bits, or 32-bit floating-point");
}

/// `count` numbers of 10, 12 or 14 bits without gaps, as the highest bits of 16.
void unpack(const unsigned char* from, std::size_t count, unsigned bits, std::uint16_t* to) {
  std::uint64_t buffer = 0;
  unsigned filled = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (; filled < bits; filled += 8) buffer = buffer << 8U | *from++;
    filled -= bits;
    to[i] = static_cast<std::uint16_t>(buffer >> filled << (16 - bits));
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
    const PixelDepth depth =
        layout_.bits == 8 ? PixelDepth::kUint8 : (layout_.bits == 32 ? PixelDepth::kFloat32 : PixelDepth::kUint16);
    Image image = new_image(layout_.width, layout_.height, layout_.samples, depth, max_pixels);
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
    const std::size_t count = std::min(width_, layout_.width - x), size = byte_count(image.depth());
    if (layout_.bits % 8 != 0) {
      unpacked_.resize(count * in_chunk_);
      unpack(from, unpacked_.size(), layout_.bits, unpacked_.data());
      from = reinterpret_cast<const unsigned char*>(unpacked_.data());
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
  std::vector<std::uint16_t> unpacked_;
};

/// White as the highest value, where the file has it as 0.
void invert_grey(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels());
  const auto invert = [&]<class Value>(std::span<Value> values) {
    for (std::size_t i = 0; i < values.size(); i += channels)
      values[i] = static_cast<Value>(static_cast<Value>(full_value(image.depth())) - values[i]);
  };
  if (image.depth() == PixelDepth::kUint8) invert(image.values<std::uint8_t>());
  if (image.depth() == PixelDepth::kUint16) invert(image.values<std::uint16_t>());
  if (image.depth() == PixelDepth::kFloat32) invert(image.values<float>());
}

/// By libtiff's conversion to red, green, blue and alpha; grey stays grey. It multiplies alpha in.
Image read_converted(TIFF* tif, const Layout& layout, std::int64_t max_pixels) {
  const bool has_alpha = layout.samples == 4 && layout.photometric == PHOTOMETRIC_RGB;
  const int channels = has_alpha ? 4 : (layout.is_grey() ? 1 : 3);
  Image image = new_image(layout.width, layout.height, channels, PixelDepth::kUint8, max_pixels);
  std::vector<std::uint32_t> pixels(image.pixel_count());
  // Rows in the order of the file: they are turned later.
  if (TIFFReadRGBAImageOriented(tif, layout.width, layout.height, pixels.data(), layout.orientation, 1) == 0)
    fail_as_damaged();
  auto value = image.values<std::uint8_t>().begin();
  for (const std::uint32_t pixel : pixels)
    for (int c = 0; c < channels; ++c) *value++ = static_cast<std::uint8_t>(pixel >> (8 * c));
  if (has_alpha) unpremultiply(image);
  return image;
}

/// Orientations as in TIFF 6.0, section 8: 1 is upright; 2 to 4 are flipped, 5 to 8 have rows for columns.
Image upright(const Image& image, int orientation) {
  if (orientation < 2 || orientation > 8) return image;
  const bool is_transposed = orientation > 4;
  const bool flips_x = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool flips_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  Image result(is_transposed ? image.height() : image.width(), is_transposed ? image.width() : image.height(),
               image.channels(), image.depth());
  const std::size_t size = byte_count(image.depth()) * static_cast<std::size_t>(image.channels());
  for (int y = 0; y < result.height(); ++y)
    for (int x = 0; x < result.width(); ++x) {
      const int column = is_transposed ? y : x, line = is_transposed ? x : y;
      const unsigned char* from = row(image, flips_y ? image.height() - 1 - line : line) +
                                  static_cast<std::size_t>(flips_x ? image.width() - 1 - column : column) * size;
      std::memcpy(row(result, y) + static_cast<std::size_t>(x) * size, from, size);
    }
  return result;
}

bool write_all(TIFF* tif, const Image& image) {
  const bool is_float = image.depth() == PixelDepth::kFloat32, is_grey = image.channels() == 1;
  TIFFSetField(tif, TIFFTAG_IMAGEWIDTH, image.width());
  TIFFSetField(tif, TIFFTAG_IMAGELENGTH, image.height());
  TIFFSetField(tif, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * byte_count(image.depth())));
  TIFFSetField(tif, TIFFTAG_SAMPLESPERPIXEL, image.channels());
  TIFFSetField(tif, TIFFTAG_SAMPLEFORMAT, is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tif, TIFFTAG_PHOTOMETRIC, is_grey ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tif, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tif, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  if (!is_float) TIFFSetField(tif, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tif, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tif, 0));
  const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
  if (image.has_alpha()) TIFFSetField(tif, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  std::vector<unsigned char> line;
  for (int y = 0; y < image.height(); ++y) {
    line.assign(row(image, y), row(image, y) + row_size(image));  // which libtiff changes
    if (TIFFWriteScanline(tif, line.data(), static_cast<std::uint32_t>(y), 0) != 1) return false;
  }
  return TIFFFlush(tif) == 1;
}

}  // namespace

Image decode_tiff(std::string_view bytes, std::int64_t max_pixels) {
  constexpr std::int64_t kMostBytesOfPixel = 16, kMostPixels = 1LL << 30;
  MemoryFile file{bytes, {}};
  const Tiff tif = open_tiff(
      file, "rm", std::max<tmsize_t>(std::ssize(bytes), kMostBytesOfPixel * std::min(max_pixels, kMostPixels)));
  if (!tif) fail_as_damaged();
  const Layout layout(tif.get());
  check_layout(layout);
  check_size(layout.width, layout.height, max_pixels);
  Image image = layout.is_direct() ? DirectReader(tif.get(), layout, max_pixels).read(max_pixels)
                                   : read_converted(tif.get(), layout, max_pixels);
  if (layout.is_direct() && layout.photometric == PHOTOMETRIC_MINISWHITE) invert_grey(image);
  if (image.channels() == 2) image = with_colours(image);
  if (layout.is_direct() && layout.extra == EXTRASAMPLE_ASSOCALPHA && image.has_alpha()) unpremultiply(image);
  return upright(image, layout.orientation);
}

std::string encode_tiff(const Image& image) {
  MemoryFile file;
  const Tiff tif = open_tiff(file, "w");
  return tif && write_all(tif.get(), image) ? file.written : "";
}

}  // namespace pulson::images
