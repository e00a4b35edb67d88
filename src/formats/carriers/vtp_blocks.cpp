#include "vtp_blocks.hpp"

#include <algorithm>
#include <cstdint>
#include <new>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "core/base64.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

class BlockReader {
 public:
  BlockReader(const std::string& path, std::string_view text, std::size_t begin, const VtpEncoding& encoding)
      : path_(path), text_(text), encoding_(encoding) {
    block_.begin = begin;
  }

  VtpBlock read() {
    if (encoding_.is_compressed)
      read_compressed();
    else
      read_plain();
    return std::move(block_);
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const {
    throw InputError(fmt::format("{}: byte {}: {}", path_, block_.begin, reason));
  }

  std::size_t left() const { return text_.size() - std::min(block_.begin, text_.size()); }

  static std::size_t letters_of(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

  /// `count` bytes that are `skipped` bytes, or letters of base64, behind the block's begin.
  std::string take(std::size_t skipped, std::size_t count) const {
    const std::size_t size = encoding_.is_base64 ? letters_of(count) : count;
    if (count > left() || skipped > left() || size > left() - skipped) refuse("a block of numbers is cut off");
    const std::string_view part = text_.substr(block_.begin + skipped, size);
    if (!encoding_.is_base64) return std::string(part);
    std::optional<std::string> bytes = bytes_of_base64(part);
    if (!bytes || bytes->size() < count) refuse("a block of numbers is no base64");
    bytes->resize(count);
    return *std::move(bytes);
  }

  std::size_t number(const std::string& bytes, std::size_t index) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < encoding_.header_size; ++i) {
      const std::size_t byte = encoding_.is_big ? i : encoding_.header_size - 1 - i;
      value = value << 8U | static_cast<unsigned char>(bytes[index * encoding_.header_size + byte]);
    }
    return value;
  }

  void read_plain() {
    const std::size_t header = encoding_.header_size;
    const std::size_t size = number(take(0, header), 0);
    if (size > left()) refuse(fmt::format("a block of {} bytes is cut off", size));
    if (encoding_.is_base64) {
      // Some programs encode the header and the numbers separately.
      block_.has_own_padding = text_[block_.begin + letters_of(header) - 1] == '=';
      const std::size_t letters = block_.has_own_padding ? letters_of(header) : 0;
      block_.bytes = take(letters, block_.has_own_padding ? size : header + size);
      if (!block_.has_own_padding) block_.bytes.erase(0, header);
      block_.end = block_.begin + letters + letters_of(block_.has_own_padding ? size : header + size);
    } else {
      block_.bytes = take(header, size);
      block_.end = block_.begin + header + size;
    }
  }

  /// The number of parts, their size, that of the last one where it is smaller, and of each its compressed size.
  void read_compressed() {
    const std::size_t word = encoding_.header_size;
    const std::string start = take(0, 3 * word);
    const std::size_t parts = number(start, 0);
    if (parts > left() / word) refuse(fmt::format("a block of {} compressed parts is cut off", parts));
    const std::string header = take(0, (3 + parts) * word);
    block_.part_size = number(header, 1);
    const std::size_t last = number(header, 2);
    const std::size_t begin = encoding_.is_base64 ? letters_of(header.size()) : header.size();
    std::size_t compressed = 0;
    for (std::size_t i = 0; i < parts; ++i) {
      const std::size_t size = number(header, 3 + i);
      if (size > left() - compressed) refuse("a compressed part is cut off");
      compressed += size;
    }
    const std::string all = take(begin, compressed);
    block_.end = block_.begin + begin + (encoding_.is_base64 ? letters_of(compressed) : compressed);
    for (std::size_t i = 0, at = 0; i < parts; at += number(header, 3 + i), ++i)
      inflate(std::string_view(all).substr(at, number(header, 3 + i)),
              i + 1 == parts && last > 0 ? last : block_.part_size);
  }

  void inflate(std::string_view part, std::size_t size) {
    constexpr std::size_t kLargestRatio = 1032;  // 258 bytes from two bits, the best that deflate can do
    if (size / kLargestRatio > part.size()) refuse("a compressed part is too short for its numbers");
    const std::size_t before = block_.bytes.size();
    block_.bytes.resize(before + size);
    uLongf inflated = size;
    const int state = uncompress(reinterpret_cast<Bytef*>(block_.bytes.data() + before), &inflated,
                                 reinterpret_cast<const Bytef*>(part.data()), part.size());
    if (state == Z_MEM_ERROR) throw std::bad_alloc();
    if (state != Z_OK || inflated != size) refuse("a compressed part is damaged");
  }

  const std::string& path_;
  std::string_view text_;
  const VtpEncoding& encoding_;
  VtpBlock block_;
};

void append_number(std::string& out, std::uint64_t value, const VtpEncoding& encoding) {
  for (std::size_t i = 0; i < encoding.header_size; ++i) {
    const std::size_t byte = encoding.is_big ? encoding.header_size - 1 - i : i;
    out += static_cast<char>(value >> (8 * byte) & 0xFFU);
  }
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
               bytes.size()) != Z_OK)
    throw std::bad_alloc();
  result.resize(size);
  return result;
}

}  // namespace

VtpBlock read_vtp_block(const std::string& path, std::string_view text, std::size_t begin,
                        const VtpEncoding& encoding) {
  return BlockReader(path, text, begin, encoding).read();
}

std::string vtp_block_text(const VtpBlock& block, std::string_view bytes, const VtpEncoding& encoding) {
  std::string header, data;
  if (encoding.is_compressed) {
    const std::size_t part = std::max<std::size_t>(block.part_size, 1);
    append_number(header, (bytes.size() + part - 1) / part, encoding);
    append_number(header, block.part_size, encoding);
    append_number(header, bytes.size() % part, encoding);
    for (std::size_t at = 0; at < bytes.size(); at += part) {
      const std::string compressed = deflated(bytes.substr(at, part));
      append_number(header, compressed.size(), encoding);
      data += compressed;
    }
  } else {
    append_number(header, bytes.size(), encoding);
    data = bytes;
  }
  if (!encoding.is_base64) return header + data;
  return encoding.is_compressed || block.has_own_padding ? base64(header) + base64(data) : base64(header + data);
}

}  // namespace pulson::formats
