#include <bit>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {

std::string npy_bytes(std::span<const double> numbers, const std::vector<std::size_t>& shape) {
  constexpr std::size_t kAlignment = 64;  // of the numbers
  constexpr std::size_t kPrefix = 10;     // magic, version, length of the header
  static_assert(std::endian::native == std::endian::little);
  std::string header =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}", fmt::join(shape, ", "));
  header.append(kAlignment - 1 - (kPrefix + header.size()) % kAlignment, ' ');
  header += '\n';
  std::string file("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(header.size() & 0xFFU);
  file += static_cast<char>(header.size() >> 8U);
  file += header;
  const std::size_t begin = file.size();
  file.resize(begin + numbers.size_bytes());
  if (!numbers.empty()) std::memcpy(file.data() + begin, numbers.data(), numbers.size_bytes());
  return file;
}

void write_npy(const std::filesystem::path& path, std::span<const double> numbers,
               const std::vector<std::size_t>& shape) {
  write_file_atomically(path, npy_bytes(numbers, shape));
}

}  // namespace pulson
