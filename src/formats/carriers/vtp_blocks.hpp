#pragma once

// The encoded numbers of VTK's XML files: base64 or bytes, compressed by zlib or not.

#include <cstddef>
#include <string>
#include <string_view>

namespace pulson::formats {

/// How the file says that all of its blocks are encoded.
struct VtpEncoding {
  bool is_big = false;          ///< the highest byte of a number comes first
  std::size_t header_size = 4;  ///< bytes of each number of a header
  bool is_compressed = false;
  bool is_base64 = true;
};

/// A block of numbers in a file.
struct VtpBlock {
  std::size_t begin = 0;  ///< in the file, with its header
  std::size_t end = 0;
  std::string bytes{};           ///< of the numbers
  std::size_t part_size = 0;     ///< of what is compressed at a time
  bool has_own_padding = false;  ///< the header is a base64 text of its own
};

/// The block that begins at the byte `begin` of `text`.
/// @throws InputError that begins with `path` if it is damaged or cut off, before memory is allocated for numbers that
/// cannot be there
VtpBlock read_vtp_block(const std::string& path, std::string_view text, std::size_t begin, const VtpEncoding& encoding);

/// The header and the bytes of a block with other numbers.
std::string vtp_block_text(const VtpBlock& block, std::string_view bytes, const VtpEncoding& encoding);

}  // namespace pulson::formats
