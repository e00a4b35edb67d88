#include "zip_archive.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <zlib.h>

#include "core/checksum.hpp"
#include "core/paths.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

// The parts of an archive by PKWARE's APPNOTE: a local header before each file, a directory, and an end of it.
constexpr std::string_view kZipLocalMark("PK\x03\x04", 4);
constexpr std::string_view kZipDirectoryMark("PK\x01\x02", 4);
constexpr std::string_view kZipEndMark("PK\x05\x06", 4);
constexpr std::size_t kZipLocalHeader = 30;
constexpr std::size_t kZipDirectoryHeader = 46;
constexpr std::size_t kZipEnd = 22;

std::size_t number_in(std::string_view bytes, std::size_t at, std::size_t length) {
  std::size_t value = 0;
  for (std::size_t i = length; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// The packed bytes behind the local header at `offset`; nothing where they are not in the archive.
std::string_view packed_at(std::string_view bytes, std::size_t offset, std::size_t size) {
  if (offset > bytes.size() || bytes.size() - offset < kZipLocalHeader) return {};
  const std::string_view local = bytes.substr(offset);
  if (!local.starts_with(kZipLocalMark)) return {};
  const std::size_t begin = kZipLocalHeader + number_in(local, 26, 2) + number_in(local, 28, 2);
  return begin <= local.size() && size <= local.size() - begin ? local.substr(begin, size) : std::string_view();
}

}  // namespace

bool is_zip(std::string_view bytes) { return bytes.starts_with(kZipLocalMark) || bytes.starts_with(kZipEndMark); }

std::vector<ZipEntry> zip_entries(std::string_view bytes) {
  const std::size_t end = bytes.rfind(kZipEndMark);
  if (!is_zip(bytes) || end == std::string_view::npos || bytes.size() - end < kZipEnd) return {};
  std::size_t left = number_in(bytes, end + 10, 2);
  std::size_t at = number_in(bytes, end + 16, 4);
  std::vector<ZipEntry> entries;
  for (; left > 0; --left) {
    if (at > end || end - at < kZipDirectoryHeader || !bytes.substr(at).starts_with(kZipDirectoryMark)) return {};
    const std::size_t name_length = number_in(bytes, at + 28, 2);
    const std::size_t length =
        kZipDirectoryHeader + name_length + number_in(bytes, at + 30, 2) + number_in(bytes, at + 32, 2);
    if (end - at < length) return {};
    ZipEntry entry;
    entry.name = bytes.substr(at + kZipDirectoryHeader, name_length);
    entry.method = static_cast<std::uint16_t>(number_in(bytes, at + 10, 2));
    entry.crc = static_cast<std::uint32_t>(number_in(bytes, at + 16, 4));
    entry.size = number_in(bytes, at + 24, 4);
    entry.packed = packed_at(bytes, number_in(bytes, at + 42, 4), number_in(bytes, at + 20, 4));
    if (!entry.name.ends_with('/')) entries.push_back(std::move(entry));
    at += length;
  }
  return entries;
}

std::string unpacked(const std::string& path, const ZipEntry& entry) {
  const auto fail = [&](std::string_view problem) {
    throw InputError(fmt::format("{}: {} {}", path, text::in_quotes(entry.name), problem));
  };
  // deflate packs at most 1032 bytes into one: a larger claim is no such file
  constexpr std::size_t kMostPacked = 1032;
  if (entry.size > kMostText) fail("is too large");
  if (entry.size / kMostPacked > entry.packed.size()) fail("is broken");
  std::string text;
  if (entry.method == 0) {
    text = entry.packed;
  } else if (entry.method == 8) {
    text.resize(entry.size);
    z_stream stream{};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(entry.packed.data()));
    stream.avail_in = static_cast<uInt>(entry.packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(text.data());
    stream.avail_out = static_cast<uInt>(text.size());
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) fail("cannot be unpacked");
    const int result = inflate(&stream, Z_FINISH);
    inflateEnd(&stream);
    if (result != Z_STREAM_END || stream.avail_out != 0) fail("is broken");
  } else {
    fail(fmt::format("is packed by method {} of zip; stored and deflated ones are read", entry.method));
  }
  if (text.size() != entry.size || crc32_of(text) != entry.crc) fail("is broken: its checksum is another");
  return text;
}

}  // namespace pulson::formats
