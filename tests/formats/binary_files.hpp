#pragma once

// Files of bytes for tests: regions of ImageJ by the layout of its class RoiEncoder, and archives of zip by PKWARE's
// APPNOTE.

#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <zlib.h>

#include "core/checksum.hpp"

namespace pulson::formats {

inline std::string big_endian(std::uint32_t number, int bytes) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += static_cast<char>(number >> (8 * i) & 0xFFU);
  return text;
}

inline std::string little_endian_bytes(std::uint32_t number, int bytes) {
  const std::string text = big_endian(number, bytes);
  return {text.rbegin(), text.rend()};
}

/// What a region has besides its type and points.
struct RoiParts {
  std::string name{};          ///< ASCII
  int position = 0;            ///< of the slice
  std::vector<int> slices{};   ///< of each point
  bool has_fractions = false;  ///< coordinates as floats too
};

inline std::string roi_bytes(int type, const std::vector<std::pair<double, double>>& points,
                             const RoiParts& parts = {}) {
  double left = points.front().first, top = points.front().second;
  for (const auto& [x, y] : points) {
    left = std::min(left, x);
    top = std::min(top, y);
  }
  const auto count = static_cast<std::uint32_t>(points.size());
  std::string text = "Iout" + big_endian(228, 2) + big_endian(static_cast<std::uint32_t>(type), 1) + '\0';
  text += big_endian(static_cast<std::uint32_t>(top), 2) + big_endian(static_cast<std::uint32_t>(left), 2);
  text += big_endian(0, 4) + big_endian(count, 2);
  text.resize(50, '\0');
  text += big_endian(parts.has_fractions ? 128 : 0, 2);
  text.resize(56, '\0');
  text += big_endian(static_cast<std::uint32_t>(parts.position), 4) + big_endian(0, 4);
  for (const int axis : {0, 1})
    for (const auto& [x, y] : points)
      text += big_endian(
          static_cast<std::uint32_t>((axis == 0 ? x : y)) - static_cast<std::uint32_t>(axis == 0 ? left : top), 2);
  for (const int axis : {0, 1})
    for (const auto& [x, y] : points)
      if (parts.has_fractions)
        text += big_endian(std::bit_cast<std::uint32_t>(static_cast<float>(axis == 0 ? x : y)), 4);
  const auto second = static_cast<std::uint32_t>(text.size());
  text.replace(60, 4, big_endian(second, 4));
  const std::uint32_t names = second + 64;
  const auto length = static_cast<std::uint32_t>(parts.name.size());
  std::string header(64, '\0');
  if (length > 0) header.replace(16, 8, big_endian(names, 4) + big_endian(length, 4));
  if (!parts.slices.empty()) header.replace(48, 4, big_endian(names + 2 * length, 4));
  text += header;
  for (const char c : parts.name) text += std::string(1, '\0') + c;
  for (const int slice : parts.slices) text += big_endian(static_cast<std::uint32_t>(slice) << 8U, 4);
  return text;
}

inline std::string deflated(const std::string& bytes) {
  std::string packed(bytes.size() + 100, '\0');
  z_stream stream{};
  deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string copy = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(copy.data());
  stream.avail_in = static_cast<uInt>(copy.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(packed.size() - stream.avail_out);
  deflateEnd(&stream);
  return packed;
}

inline std::string gzipped(const std::string& bytes) {
  return std::string("\x1F\x8B\x08\0\0\0\0\0\0\x03", 10) + deflated(bytes) + little_endian_bytes(crc32_of(bytes), 4) +
         little_endian_bytes(static_cast<std::uint32_t>(bytes.size()), 4);
}

inline std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& files, bool is_deflated = true) {
  std::string text, directory;
  for (const auto& [name, bytes] : files) {
    const std::string packed = is_deflated ? deflated(bytes) : bytes;
    const auto number = [](std::size_t value, int size) {
      return little_endian_bytes(static_cast<std::uint32_t>(value), size);
    };
    const std::string common = number(20, 2) + number(0, 2) + number(is_deflated ? 8 : 0, 2) + number(0, 4) +
                               number(crc32_of(bytes), 4) + number(packed.size(), 4) + number(bytes.size(), 4) +
                               number(name.size(), 2) + number(0, 2);
    directory += "PK\1\2" + number(20, 2) + common + number(0, 2) + number(0, 2) + number(0, 2) + number(0, 4) +
                 number(text.size(), 4) + name;
    text += "PK\3\4" + common + name + packed;
  }
  const auto count = static_cast<std::uint32_t>(files.size());
  return text + directory + "PK\5\6" + little_endian_bytes(0, 4) + little_endian_bytes(count, 2) +
         little_endian_bytes(count, 2) + little_endian_bytes(static_cast<std::uint32_t>(directory.size()), 4) +
         little_endian_bytes(static_cast<std::uint32_t>(text.size()), 4) + little_endian_bytes(0, 2);
}

}  // namespace pulson::formats
