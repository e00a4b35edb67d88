#include "checksum.hpp"

#include <fmt/format.h>
#include <zlib.h>

namespace pulson {
namespace {

constexpr std::size_t kSealBytes = 4;

}  // namespace

std::uint32_t crc32_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string crc32_text(std::string_view bytes) { return fmt::format("{:08x}", crc32_of(bytes)); }

std::string sealed(std::string bytes) {
  const std::uint32_t sum = crc32_of(bytes);
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(static_cast<unsigned char>(sum >> shift));
  return bytes;
}

bool unseal(std::string_view& bytes) {
  if (bytes.size() < kSealBytes) return false;
  const std::string_view seal = bytes.substr(bytes.size() - kSealBytes);
  bytes.remove_suffix(kSealBytes);
  std::uint32_t sum = 0;
  for (const char byte : seal) sum = sum << 8U | static_cast<unsigned char>(byte);
  return sum == crc32_of(bytes);
}

}  // namespace pulson
