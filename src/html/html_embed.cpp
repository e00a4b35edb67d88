#include "html_embed.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::html {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kJpegSignature = "\xFF\xD8\xFF";
constexpr std::size_t kHeadOfSvg = 4096;  // where its first element must be found

std::string read(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw InputError(fmt::format("cannot read the picture '{}': it is a folder", file.string()));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw InputError(fmt::format("cannot read the picture '{}': {}", file.string(), std::strerror(errno)));
  return bytes;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0) {
      result += "\uFFFD";
    } else if (length > 1) {
      result += text.substr(i, length);
    } else if (byte < 0x20 || byte == 0x7F) {
      result += ' ';
    } else if (byte == '&') {
      result += "&amp;";
    } else if (byte == '<') {
      result += "&lt;";
    } else if (byte == '>') {
      result += "&gt;";
    } else if (byte == '"') {
      result += "&quot;";
    } else {
      result += text[i];
    }
    i += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string valid_utf8(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    result += length == 0 ? "\uFFFD" : text.substr(i, length);
    i += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
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

std::string data_address(const std::filesystem::path& picture) {
  const std::string bytes = read(picture);
  if (bytes.starts_with(kPngSignature)) return "data:image/png;base64," + base64(bytes);
  if (bytes.starts_with(kJpegSignature)) return "data:image/jpeg;base64," + base64(bytes);
  if (std::string_view(bytes).substr(0, kHeadOfSvg).find("<svg") != std::string_view::npos)
    return "data:image/svg+xml;base64," + base64(bytes);
  throw InputError(fmt::format("the picture '{}' is not SVG, PNG or JPEG", picture.string()));
}

}  // namespace pulson::html
