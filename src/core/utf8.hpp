#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pulson {

/// Bytes of the UTF-8 sequence that starts at byte `i`, 0 if it is broken.
std::size_t utf8_length(std::string_view text, std::size_t i);

/// Whether a byte of UTF-8 begins a character.
constexpr bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

bool is_utf8(std::string_view text);

/// Text in Windows-1252, which holds ISO 8859-1, in UTF-8.
std::string utf8_of_windows_1252(std::string_view text);

}  // namespace pulson
