// The chunks of a png that libpng is not asked for: length, name, data and check sum, as PNG's specification has them.

#include "png_chunks.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>

#include <zlib.h>

#include "codecs.hpp"
#include "exif.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::images {
namespace {

constexpr double kCentimetresPerMetre = 100, kMetresPerInch = 0.0254;
constexpr std::size_t kSignature = 8, kAroundData = 12;

std::uint32_t number(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(0, 4)) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

std::string as_bytes(std::uint32_t value) {
  std::string bytes;
  for (unsigned shift = 32; shift > 0; shift -= 8) bytes += static_cast<char>(value >> (shift - 8) & 255U);
  return bytes;
}

std::uint32_t check_sum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

std::string chunk(std::string_view name, std::string_view data) {
  std::string named(name);
  named += data;
  return as_bytes(static_cast<std::uint32_t>(data.size())) + named + as_bytes(check_sum(named));
}

/// Whether a chunk stays true where pixels change: what is said of colours, scales and in words, and of unknown ones
/// those that say so, by a small fourth letter.
bool is_kept(std::string_view name) {
  static constexpr std::string_view kKnown[] = {"gAMA", "cHRM", "sRGB", "cICP", "mDCV", "cLLI", "sBIT",
                                                "tEXt", "zTXt", "iTXt", "oFFs", "pCAL", "sCAL", "sTER"};
  static constexpr std::string_view kOurs[] = {"pHYs", "iCCP", "eXIf", "tRNS", "bKGD", "hIST", "sPLT", "tIME"};
  if (std::find(std::begin(kKnown), std::end(kKnown), name) != std::end(kKnown)) return true;
  if (std::find(std::begin(kOurs), std::end(kOurs), name) != std::end(kOurs)) return false;
  return std::islower(static_cast<unsigned char>(name[0])) != 0 &&
         std::islower(static_cast<unsigned char>(name[3])) != 0;
}

/// The profile of ICC, of no more bytes than any has; none where it is damaged.
std::string profile_of(std::string_view data) {
  constexpr std::size_t kLargest = std::size_t{16} << 20U, kPart = std::size_t{1} << 16U;
  const std::size_t name = data.find('\0');
  if (name == std::string_view::npos || name + 2 > data.size()) return "";
  const std::string_view packed = data.substr(name + 2);
  std::string profile;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return "";
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));  // it reads them alone
  stream.avail_in = static_cast<uInt>(packed.size());
  int state = Z_OK;
  while (state == Z_OK && profile.size() < kLargest) {
    profile.resize(profile.size() + kPart);
    stream.next_out = reinterpret_cast<Bytef*>(profile.data() + profile.size() - kPart);
    stream.avail_out = kPart;
    state = inflate(&stream, Z_NO_FLUSH);
  }
  profile.resize(profile.size() - stream.avail_out);
  inflateEnd(&stream);
  return state == Z_STREAM_END ? profile : "";
}

std::string profile_chunk(const std::string& profile) {
  uLongf size = compressBound(profile.size());
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(profile.data()),
           profile.size());
  packed.resize(size);
  return chunk("iCCP", std::string("profile\0\0", 9) + packed);
}

std::optional<Resolution> resolution_of(std::string_view data) {
  if (data.size() != 9 || number(data) == 0 || number(data.substr(4)) == 0) return std::nullopt;
  const bool is_per_metre = data[8] == 1;
  const double unit = is_per_metre ? kCentimetresPerMetre : 1;
  return Resolution{number(data) / unit, number(data.substr(4)) / unit,
                    is_per_metre ? Resolution::Unit::kCentimetre : Resolution::Unit::kNone};
}

std::string resolution_chunk(const Resolution& resolution) {
  using enum Resolution::Unit;
  constexpr double kHighest = 0x7FFFFFFF, kParts = 1000;  // of a ratio that is not of whole numbers
  const bool is_whole = std::round(resolution.x) == resolution.x && std::round(resolution.y) == resolution.y;
  double factor = is_whole ? 1 : kParts;
  if (resolution.unit == kInch) factor = 1 / kMetresPerInch;
  if (resolution.unit == kCentimetre) factor = kCentimetresPerMetre;
  const auto per_metre = [&](double value) {
    return as_bytes(static_cast<std::uint32_t>(std::clamp(std::round(value * factor), 1.0, kHighest)));
  };
  return chunk("pHYs", per_metre(resolution.x) + per_metre(resolution.y) + (resolution.unit == kNone ? '\0' : '\x01'));
}

}  // namespace

PageMetadata metadata_of_png(std::string_view file) {
  PageMetadata about;
  for (std::string_view rest = file.substr(std::min(file.size(), kSignature)); rest.size() >= kAroundData;) {
    const std::size_t size = number(rest);
    if (size > rest.size() - kAroundData) break;
    const std::string_view name = rest.substr(4, 4), data = rest.substr(8, size);
    const bool is_whole = number(rest.substr(8 + size)) == check_sum(rest.substr(4, 4 + size));
    if (name == "acTL")
      throw InputError("it is an animated png; save its pictures as pages of a tif, or as files of their own");
    if (name == "pHYs") about.resolution = resolution_of(data);
    if (name == "iCCP") about.profile = profile_of(data);
    if (name == "eXIf") about.exif = data;
    if (is_whole && is_kept(name)) about.png_chunks += rest.substr(0, size + kAroundData);
    rest.remove_prefix(size + kAroundData);
  }
  about.orientation = exif_orientation(about.exif);
  return about;
}

std::string chunks_of(const PageMetadata& about) {
  std::string chunks = about.png_chunks;
  if (about.resolution) chunks += resolution_chunk(*about.resolution);
  if (!about.profile.empty()) chunks += profile_chunk(about.profile);
  const std::string exif = exif_of(about.exif, about.orientation);
  return exif.empty() ? chunks : chunks + chunk("eXIf", exif);
}

}  // namespace pulson::images
