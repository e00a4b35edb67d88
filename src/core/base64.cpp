#include "core/base64.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace pulson {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The value of each letter; 64 of all other bytes.
constexpr std::array<std::uint8_t, 256> values_of_letters() {
  std::array<std::uint8_t, 256> values{};
  values.fill(64);
  for (std::size_t i = 0; i < kLetters.size(); ++i)
    values[static_cast<unsigned char>(kLetters[i])] = static_cast<std::uint8_t>(i);
  return values;
}

}  // namespace

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = 256 * bits + (j < count ? static_cast<unsigned char>(bytes[i + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? kLetters[bits >> (18 - 6 * j) & 63U] : '=';
  }
  return text;
}

std::optional<std::string> bytes_of_base64(std::string_view text) {
  static constexpr std::array<std::uint8_t, 256> kValues = values_of_letters();
  if (text.size() % 4 != 0) return std::nullopt;
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    const std::string_view group = text.substr(i, 4);
    const std::size_t letters = std::min<std::size_t>(group.find('='), 4);
    if (letters < 2 || group.find_first_not_of('=', letters) != std::string_view::npos) return std::nullopt;
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      const std::uint32_t value = j < letters ? kValues[static_cast<unsigned char>(group[j])] : 0U;
      if (value > 63) return std::nullopt;
      bits = bits << 6U | value;
    }
    for (std::size_t j = 0; j + 1 < letters; ++j) bytes += static_cast<char>(bits >> (16 - 8 * j) & 0xFFU);
  }
  return bytes;
}

}  // namespace pulson
