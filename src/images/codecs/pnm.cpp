// pbm, pgm and ppm as the manual pages of Netpbm define them.

#include <bit>
#include <cctype>
#include <cmath>

#include "codecs.hpp"

namespace pulson::images {
namespace {

class PnmReader {
 public:
  explicit PnmReader(std::string_view bytes) : rest_(bytes) {}

  Image read() {
    const char kind = rest_[1];
    rest_.remove_prefix(2);
    const bool is_text = kind <= '3', is_bitmap = kind == '1' || kind == '4', has_colour = kind == '3' || kind == '6';
    const unsigned width = number(), height = number();
    highest_ = is_bitmap ? 1 : number();
    if (highest_ < 1 || highest_ > 65535) fail_as_damaged();
    Image image =
        new_image(width, height, has_colour ? 3 : 1, highest_ > 255 ? PixelDepth::kUint16 : PixelDepth::kUint8);
    if (!is_text) byte();  // one white character
    if (kind == '4')
      read_bits(image);
    else if (highest_ > 255)
      for (std::uint16_t& value : image.values<std::uint16_t>())
        value = scaled<std::uint16_t>(is_text ? number() : 256U * byte() + byte());
    else
      for (std::uint8_t& value : image.values<std::uint8_t>())
        value = scaled<std::uint8_t>(kind == '1' ? 1U - bit() : (is_text ? number() : byte()));
    return image;
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
        row(image, y)[x] = (bits & 128) != 0 ? 0 : 255;
      }
  }

  template <class Value>
  Value scaled(unsigned value) const {
    constexpr unsigned kFull = static_cast<Value>(-1);
    return static_cast<Value>((std::min(value, highest_) * kFull + highest_ / 2) / highest_);
  }

  std::string_view rest_;
  unsigned highest_ = 1;
};

}  // namespace

Image decode_pnm(std::string_view bytes) { return PnmReader(bytes).read(); }

std::string encode_pnm(const Image& image) {
  std::string bytes = std::string(image.channels() == 1 ? "P5" : "P6") + "\n" + std::to_string(image.width()) + " " +
                      std::to_string(image.height()) + "\n" + (image.depth() == PixelDepth::kUint8 ? "255" : "65535") +
                      "\n";
  const std::size_t start = bytes.size();
  bytes.append(reinterpret_cast<const char*>(image.bytes().data()), image.bytes().size());
  if (image.depth() == PixelDepth::kUint16 && std::endian::native == std::endian::little)
    for (std::size_t i = start; i < bytes.size(); i += 2) std::swap(bytes[i], bytes[i + 1]);
  return bytes;
}

}  // namespace pulson::images
