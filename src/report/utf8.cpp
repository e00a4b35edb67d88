#include "utf8.hpp"

namespace pulson::picture {
namespace {

/// Whether the two bytes begin a sequence that is too long for its number, a surrogate, or beyond U+10FFFF.
bool is_forbidden(unsigned char lead, unsigned char second) {
  return (lead == 0xE0 && second < 0xA0) || (lead == 0xED && second > 0x9F) || (lead == 0xF0 && second < 0x90) ||
         (lead == 0xF4 && second > 0x8F);
}

}  // namespace

std::size_t utf8_length(std::string_view text, std::size_t i) {
  const auto byte = [text](std::size_t j) { return static_cast<unsigned char>(text[j]); };
  const unsigned char lead = byte(i);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xC2 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF5 ? 4
                                           : 0;
  if (i + length > text.size()) return 0;
  for (std::size_t j = i + 1; j < i + length; ++j)
    if ((byte(j) & 0xC0) != 0x80) return 0;
  return length > 2 && is_forbidden(lead, byte(i + 1)) ? 0 : length;
}

}  // namespace pulson::picture
