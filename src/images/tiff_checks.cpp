// The tags of the first page of a tif, as in TIFF Revision 6.0 (Adobe, 1992), sections 2 and 8.

#include <cstddef>
#include <cstdint>
#include <map>

#include "file_checks.hpp"

namespace pulson::images {
namespace {

enum Tag : unsigned { kBits = 258, kPhotometric = 262, kSamples = 277, kPlanar = 284, kExtraSamples = 338 };

class TiffTags {
 public:
  /// The first value of each tag of the first page that is a short or long number.
  static std::optional<TiffTags> read(std::string_view bytes) {
    TiffTags tags(bytes);
    if (!bytes.starts_with(std::string_view("II*\0", 4)) && !bytes.starts_with(std::string_view("MM\0*", 4))) return {};
    const std::size_t page = tags.number(4, 4);
    const std::size_t count = tags.number(page, 2);
    for (std::size_t i = 0; i < count; ++i) tags.read_entry(page + 2 + 12 * i);
    if (tags.is_beyond_end_) return {};
    return tags;
  }

  std::size_t value(Tag tag, std::size_t otherwise) const {
    const auto found = values_.find(tag);
    return found == values_.end() ? otherwise : found->second;
  }

 private:
  explicit TiffTags(std::string_view bytes) : bytes_(bytes), is_little_(bytes.starts_with('I')) {}

  std::size_t number(std::size_t at, std::size_t width) {
    if (at + width > bytes_.size()) {
      is_beyond_end_ = true;
      return 0;
    }
    std::size_t result = 0;
    for (std::size_t i = 0; i < width; ++i)
      result = 256 * result + static_cast<unsigned char>(bytes_[is_little_ ? at + width - 1 - i : at + i]);
    return result;
  }

  void read_entry(std::size_t at) {
    const std::size_t type = number(at + 2, 2), count = number(at + 4, 4);
    if (type != 3 && type != 4) return;
    const std::size_t width = type == 3 ? 2 : 4;
    // Up to four bytes stand in the entry itself; more, at the offset that it holds.
    const std::size_t place = width * count <= 4 ? at + 8 : number(at + 8, 4);
    values_[number(at, 2)] = number(place, width);
  }

  std::string_view bytes_;
  bool is_little_;
  bool is_beyond_end_ = false;
  std::map<std::size_t, std::size_t> values_;
};

/// Observed of OpenCV 4.6: 8 bits go through libtiff's RGBA interface, more are taken as they lie in the file.
std::string why_unreadable(const TiffTags& tags) {
  const bool is_raw = tags.value(kBits, 1) > 8;
  if (tags.value(kSamples, 1) == 2) return "a tif of two channels (grey and alpha)";
  if (is_raw && tags.value(kPlanar, 1) == 2) return "a tif of more than 8 bits with its channels in separate planes";
  if (is_raw && tags.value(kPhotometric, 1) == 0) return "a tif of more than 8 bits in which white is 0";
  return "";
}

bool is_premultiplied(const TiffTags& tags) {
  constexpr std::size_t kAssociated = 1, kUnassociated = 2;
  if (tags.value(kSamples, 1) != 4) return false;
  const std::size_t alpha = tags.value(kExtraSamples, 0);
  // libtiff's RGBA interface multiplies alpha in where the file does not.
  return alpha == kAssociated || (alpha == kUnassociated && tags.value(kBits, 1) <= 8);
}

}  // namespace

std::optional<TiffFacts> tiff_facts(std::string_view bytes) {
  const std::optional<TiffTags> tags = TiffTags::read(bytes);
  if (!tags) return {};
  return TiffFacts{why_unreadable(*tags), is_premultiplied(*tags)};
}

}  // namespace pulson::images
