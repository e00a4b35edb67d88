// pbm, pgm and ppm as the manual pages of Netpbm define them.

// Windows' BMP, as its header BITMAPINFOHEADER and its successors say, and that of OS/2 1.x, by BITMAPCOREHEADER.

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include "codecs.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {

namespace {

class PnmReader {
 public:
  explicit PnmReader(std::string_view bytes) : rest_(bytes) {}

  PictureFile read(std::int64_t max_pixels) {
    const char kind = rest_[1];
    rest_.remove_prefix(2);
    const bool is_text = kind <= '3', is_bitmap = kind == '1' || kind == '4', has_colour = kind == '3' || kind == '6';
    const unsigned width = number(), height = number();
    highest_ = is_bitmap ? 1 : number();
    if (highest_ < 1 || highest_ > 65535) fail_as_damaged();
    PictureFile file;
    Image& image = file.pages.emplace_back().image;
    image = new_image(width, height,
                      {has_colour ? 3 : 1, highest_ > 255 ? PixelType::kUint16 : PixelType::kUint8, Alpha::kNone,
                       static_cast<double>(highest_)},
                      max_pixels);
    if (!is_text) byte();  // one white character
    if (kind == '4')
      read_bits(image);
    else if (highest_ > 255)
      for (std::uint16_t& value : image.values<std::uint16_t>())
        value = limited<std::uint16_t>(is_text ? number() : 256U * byte() + byte());
    else
      for (std::uint8_t& value : image.values<std::uint8_t>())
        value = limited<std::uint8_t>(kind == '1' ? 1U - bit() : (is_text ? number() : byte()));
    if (bits_of(image.format()) == 0) {  // which no format that is written holds
      file.notes.push_back("the highest value is " + std::to_string(highest_) +
                           "; numbers are scaled to the range of " + describe(image.type()) + " pixels");
      file.pages.front() = {shown(file.pages.front())};
    }
    if (!is_text && rest_.size() > 2 && rest_[0] == 'P' && rest_[1] >= '1' && rest_[1] <= '6')
      throw InputError("it holds several pictures; save each in a file of its own, or all as pages of a tif");
    return file;
  }

 private:
  unsigned byte() {
    if (rest_.empty()) fail_as_damaged();
    const auto value = static_cast<unsigned char>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }

  /// Blanks, and comments to the end of their line.
  void skip() {
    while (!rest_.empty() && (rest_.front() == '#' || std::isspace(static_cast<unsigned char>(rest_.front())) != 0))
      rest_.remove_prefix(rest_.front() == '#' ? std::min(rest_.find_first_of("\r\n"), rest_.size()) : 1);
  }

  unsigned number() {
    skip();
    if (rest_.empty() || std::isdigit(static_cast<unsigned char>(rest_.front())) == 0) fail_as_damaged();
    unsigned value = 0;
    while (!rest_.empty() && std::isdigit(static_cast<unsigned char>(rest_.front())) != 0) {
      value = 10 * value + (byte() - '0');
      if (value > 1U << 30U) fail_as_damaged();
    }
    return value;
  }

  /// Of a text, in which bits need not be parted.
  unsigned bit() {
    skip();
    const unsigned digit = byte() - '0';
    if (digit > 1) fail_as_damaged();
    return digit;
  }

  void read_bits(Image& image) {
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0, bits = 0; x < image.width(); ++x, bits *= 2) {
        if (x % 8 == 0) bits = static_cast<int>(byte());
        row(image, y)[x] = (bits & 128) != 0 ? 0 : 1;
      }
  }

  template <class Value>
  Value limited(unsigned value) const {
    return static_cast<Value>(std::min(value, highest_));
  }

  std::string_view rest_;
  unsigned highest_ = 1;
};

}  // namespace

PictureFile decode_pnm(std::string_view bytes, std::int64_t max_pixels) { return PnmReader(bytes).read(max_pixels); }

namespace {

enum Compression : std::uint32_t { kNone = 0, kRle8 = 1, kRle4 = 2, kBitFields = 3, kAlphaBitFields = 6 };

constexpr std::size_t kFileHeader = 14;
using PaletteColour = std::array<std::uint8_t, 4>;

/// One channel's bits in a pixel.
struct BitField {
  std::uint32_t mask;
  std::uint8_t value(std::uint32_t pixel) const {
    if (mask == 0) return 0;
    const int shift = std::countr_zero(mask);
    const std::uint64_t full = mask >> shift, part = (pixel & mask) >> shift;
    return static_cast<std::uint8_t>((part * 255 + full / 2) / full);
  }
};

class BmpReader {
 public:
  explicit BmpReader(std::string_view bytes) : bytes_(bytes) {
    const std::uint32_t header = number(kFileHeader, 4);
    pixels_at_ = number(10, 4);
    if (header == 12) {
      width_ = static_cast<std::int32_t>(number(18, 2)), height_ = static_cast<std::int32_t>(number(20, 2));
      bits_ = number(24, 2);
    } else {
      if (header < 40) fail_as_damaged();
      width_ = static_cast<std::int32_t>(number(18, 4)), height_ = static_cast<std::int32_t>(number(22, 4));
      bits_ = number(28, 2), compression_ = number(30, 4);
      read_resolution();
    }
    read_bit_fields(header);
    if (bits_ <= 8) read_palette(header);
  }

  PictureFile read(std::int64_t max_pixels) {
    const bool is_packed = compression_ == kRle8 || compression_ == kRle4;
    const bool is_known = bits_ == 1 || bits_ == 4 || bits_ == 8 || bits_ == 16 || bits_ == 24 || bits_ == 32;
    const bool is_fit = is_packed
                            ? bits_ == (compression_ == kRle8 ? 8U : 4U)
                            : compression_ == kNone || compression_ == kBitFields || compression_ == kAlphaBitFields;
    if (!is_known || !is_fit) fail_as_damaged();
    PictureFile file;
    Page& page = file.pages.emplace_back();
    page.about.resolution = resolution_;
    if (bits_ <= 8 && !is_grey()) set_palette(page.about);
    PixelFormat format = PixelFormat::usual(bits_ <= 8 ? 1 : (fields_[3].mask != 0 ? 4 : 3), PixelType::kUint8);
    if (bits_ <= 8) format.full = (1 << bits_) - 1;
    Image& image = page.image;
    image = new_image(width_, std::abs(std::int64_t{height_}), format, max_pixels);
    if (is_packed)
      read_packed(image);
    else
      for (int y = 0; y < image.height(); ++y) read_row(image, y);
    return file;
  }

 private:
  std::uint32_t number(std::size_t at, std::size_t width) const {
    if (at + width > bytes_.size()) fail_as_damaged();
    std::uint32_t result = 0;
    for (std::size_t i = width; i-- > 0;) result = result << 8U | static_cast<unsigned char>(bytes_[at + i]);
    return result;
  }

  void read_bit_fields(std::uint32_t header) {
    if (bits_ == 16) fields_ = {{{0x7C00}, {0x03E0}, {0x001F}, {0}}};
    if (bits_ <= 8 || (compression_ != kBitFields && compression_ != kAlphaBitFields)) return;
    const std::size_t count = header >= 56 || compression_ == kAlphaBitFields ? 4 : 3;
    for (std::size_t i = 0; i < count; ++i) fields_[i].mask = number(kFileHeader + 40 + 4 * i, 4);
  }

  void read_palette(std::uint32_t header) {
    const std::size_t used = header == 12 ? 0 : number(46, 4), all = std::size_t{1} << bits_;
    const std::size_t width = header == 12 ? 3 : 4;
    palette_.resize(all);
    for (std::size_t i = 0; i < (used == 0 ? all : std::min(used, all)); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        palette_[i][2 - c] = static_cast<std::uint8_t>(number(kFileHeader + header + width * i + c, 1));
  }

  /// Whether the number of each colour says how bright it is.
  bool is_grey() const {
    const std::size_t most = palette_.size() - 1;
    for (std::size_t i = 0; i < palette_.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c)
        if (palette_[i][c] != (i * 255 + most / 2) / most) return false;
    return true;
  }

  void set_palette(PageMetadata& about) const {
    constexpr unsigned kTo16Bits = 257;
    const auto wide = [](unsigned value) { return static_cast<std::uint16_t>(kTo16Bits * value); };
    for (const PaletteColour& colour : palette_)
      about.palette.push_back({wide(colour[0]), wide(colour[1]), wide(colour[2]), 0xFFFF});
  }

  void read_resolution() {
    const std::uint32_t x = number(38, 4), y = number(42, 4);
    constexpr double kPerMetre = 100;
    if (x > 0 && y > 0) resolution_ = Resolution{x / kPerMetre, y / kPerMetre, Resolution::Unit::kCentimetre};
  }

  /// The image's row that is row y of the file.
  unsigned char* place(Image& image, int x, int y) const {
    const int line = height_ > 0 ? image.height() - 1 - y : y;
    return row(image, line) + std::ptrdiff_t{x} * image.channels();
  }

  void put(Image& image, int x, int y, const PaletteColour& colour) const {
    std::copy_n(colour.begin(), image.channels(), place(image, x, y));
  }

  PaletteColour colour_of(std::uint32_t pixel) const {
    if (bits_ <= 8) return {static_cast<std::uint8_t>(pixel)};
    return {fields_[0].value(pixel), fields_[1].value(pixel), fields_[2].value(pixel), fields_[3].value(pixel)};
  }

  void read_row(Image& image, int y) const {
    const std::size_t stride = (static_cast<std::size_t>(width_) * bits_ + 31) / 32 * 4;
    const std::size_t start = pixels_at_ + stride * static_cast<std::size_t>(y);
    for (int x = 0; x < width_; ++x) {
      const std::size_t bit = static_cast<std::size_t>(x) * bits_;
      std::uint32_t pixel = number(start + bit / 8, std::max<std::size_t>(bits_ / 8, 1));
      if (bits_ < 8) pixel = pixel >> (8 - bits_ - bit % 8) & ((1U << bits_) - 1);
      put(image, x, y, colour_of(pixel));
    }
  }

  /// Runs of one or two alternating colours, and stretches as they are, of 8 or 4 bits a pixel. What the file leaves
  /// out is of the first colour.
  void read_packed(Image& image) const {
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < width_; ++x) put(image, x, y, {});
    std::size_t at = pixels_at_;
    const auto byte = [&] { return number(at++, 1); };
    int x = 0, y = 0;
    const auto put_next = [&](std::uint32_t pair, std::uint32_t i) {
      const std::uint32_t pixel = bits_ == 8 ? pair : (i % 2 == 0 ? pair >> 4U : pair & 15U);
      if (x < width_ && y < image.height()) put(image, x, y, colour_of(pixel));
      if (x < width_) ++x;
    };
    constexpr std::uint32_t kEndOfRow = 0, kEndOfImage = 1, kMove = 2;
    while (y < image.height()) {
      const std::uint32_t count = byte(), value = byte();
      if (count > 0) {
        for (std::uint32_t i = 0; i < count; ++i) put_next(value, i);
      } else if (value == kEndOfRow) {
        x = 0, ++y;
      } else if (value == kEndOfImage) {
        return;
      } else if (value == kMove) {
        x = std::min(width_, x + static_cast<int>(byte())), y += static_cast<int>(byte());
      } else {
        const std::size_t in_byte = 8 / bits_, start = at;
        for (std::uint32_t i = 0; i < value; ++i) put_next(number(start + i / in_byte, 1), i);
        at += ((value + in_byte - 1) / in_byte + 1) / 2 * 2;
      }
    }
  }

  std::string_view bytes_;
  std::size_t pixels_at_;
  std::int32_t width_ = 0, height_ = 0;  ///< a negative height: rows from the top
  std::uint32_t bits_ = 0, compression_ = kNone;
  std::array<BitField, 4> fields_{{{0xFF0000}, {0xFF00}, {0xFF}, {0}}};
  std::vector<PaletteColour> palette_;
  std::optional<Resolution> resolution_;
};

}  // namespace

PictureFile decode_bmp(std::string_view bytes, std::int64_t max_pixels) { return BmpReader(bytes).read(max_pixels); }

}  // namespace pulson::images
