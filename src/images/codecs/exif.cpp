#include "exif.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace pulson::images {
namespace {

constexpr std::size_t kEntrySize = 12;
constexpr std::uint32_t kOrientationTag = 0x0112, kShort = 3;

/// The first directory of a TIFF file: what is looked for is found or not, never beyond the end.
class Directory {
 public:
  explicit Directory(std::string_view bytes) : bytes_(bytes) {
    is_big_endian_ = bytes.starts_with("MM");
    if ((!is_big_endian_ && !bytes.starts_with("II")) || number(2, 2) != 42) return;
    start_ = number(4, 4).value_or(0);
    count_ = number(start_, 2).value_or(0);
  }

  /// Where the two bytes of the orientation are.
  std::optional<std::size_t> orientation_at() const {
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t entry = start_ + 2 + i * kEntrySize;
      if (number(entry, 2) == kOrientationTag && number(entry + 2, 2) == kShort && number(entry + 8, 2))
        return entry + 8;
    }
    return std::nullopt;
  }

  /// Where the four bytes are that say where the next directory is.
  std::optional<std::size_t> next_at() const {
    const std::size_t at = start_ + 2 + count_ * kEntrySize;
    return start_ > 0 && number(at, 4) ? std::optional(at) : std::nullopt;
  }

  std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
    if (at > bytes_.size() || size > bytes_.size() - at) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8U | static_cast<unsigned char>(bytes_[at + (is_big_endian_ ? i : size - 1 - i)]);
    return value;
  }

  bool is_big_endian() const { return is_big_endian_; }

 private:
  std::string_view bytes_;
  bool is_big_endian_ = false;
  std::size_t start_ = 0, count_ = 0;
};

/// One entry, the orientation.
std::string least_exif(int orientation) {
  using namespace std::string_literals;
  return "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s + static_cast<char>(orientation) + "\0\0\0\0\0\0"s;
}

}  // namespace

int exif_orientation(std::string_view exif) {
  const Directory directory(exif);
  const std::optional<std::size_t> at = directory.orientation_at();
  const std::uint32_t value = at ? directory.number(*at, 2).value_or(1) : 1;
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

std::string exif_of(std::string exif, int orientation) {
  const Directory directory(exif);
  const std::optional<std::size_t> at = directory.orientation_at(), next = directory.next_at();
  const bool is_big_endian = directory.is_big_endian();
  if (!at) {
    if (orientation != 1) return least_exif(orientation);
  } else {
    exif[*at + (is_big_endian ? 1 : 0)] = static_cast<char>(orientation);
    exif[*at + (is_big_endian ? 0 : 1)] = '\0';
  }
  if (next) exif.replace(*next, 4, 4, '\0');
  return exif;
}

}  // namespace pulson::images
