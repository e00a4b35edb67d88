#include "deflate.hpp"

#include <algorithm>
#include <memory>
#include <new>

#include <fmt/format.h>
#define ZLIB_CONST  // its input is const
#include <zlib.h>

#include "pulson/core/errors.hpp"

namespace pulson::io {
namespace {

constexpr int kWindow = 15;        // its largest
constexpr int kGzip = 16;          // added to the window: with gzip's header
constexpr int kEitherHeader = 32;  // added to the window: gzip or zlib, as the stream has it

constexpr std::size_t kPart = std::size_t{1} << 30U;  // zlib counts bytes in 32 bits

/// Lends zlib the next part of what is left of a block of bytes.
template <class Byte, class Pointer>
void lend(Byte*& at, std::size_t& left, Pointer& next, uInt& available) {
  if (available > 0 || left == 0) return;
  available = static_cast<uInt>(std::min(left, kPart));
  next = reinterpret_cast<Pointer>(at);
  at += available;
  left -= available;
}

}  // namespace

std::string deflated(std::string_view bytes, bool as_gzip) {
  constexpr int kLevel = 2;  // as ITK: floats gain little from a higher one, which takes far longer
  constexpr int kMemory = 8;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kWindow + (as_gzip ? kGzip : 0), kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &deflateEnd);

  std::string result(deflateBound(&stream, bytes.size()), '\0');
  const char* from = bytes.data();
  char* to = result.data();
  std::size_t from_left = bytes.size(), to_left = result.size();
  int state = Z_OK;
  while (state == Z_OK) {
    lend(from, from_left, stream.next_in, stream.avail_in);
    lend(to, to_left, stream.next_out, stream.avail_out);
    state = deflate(&stream, from_left == 0 ? Z_FINISH : Z_NO_FLUSH);
  }
  if (state != Z_STREAM_END) throw std::bad_alloc();  // of all that can go wrong in memory, what is left
  result.resize(result.size() - to_left - stream.avail_out);
  return result;
}

std::string inflated(std::string_view stream_bytes, std::size_t size, const std::string& what) {
  constexpr std::size_t kLargestRatio = 1032;  // 258 bytes from two bits, the best that deflate can do
  if (size / kLargestRatio > stream_bytes.size())
    throw InputError(fmt::format("{} are cut off: {} compressed bytes cannot be {}", what, stream_bytes.size(), size));
  z_stream stream{};
  if (inflateInit2(&stream, kWindow + kEitherHeader) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &inflateEnd);

  std::string result(size + 1, '\0');  // one byte more, so that a stream that is too long shows
  const char* from = stream_bytes.data();
  char* to = result.data();
  std::size_t from_left = stream_bytes.size(), to_left = result.size();
  int state = Z_OK;
  while (state == Z_OK) {
    lend(from, from_left, stream.next_in, stream.avail_in);
    lend(to, to_left, stream.next_out, stream.avail_out);
    state = inflate(&stream, Z_NO_FLUSH);
  }
  const std::size_t taken = result.size() - to_left - stream.avail_out;
  if (taken > size) throw InputError(fmt::format("{} are more than the {} bytes that its sizes need", what, size));
  if (state == Z_DATA_ERROR || state == Z_NEED_DICT)
    throw InputError(fmt::format("{} are damaged: zlib says {}", what, stream.msg != nullptr ? stream.msg : "no more"));
  if (state == Z_MEM_ERROR) throw std::bad_alloc();
  if (state != Z_STREAM_END || taken < size)
    throw InputError(fmt::format("{} are cut off: {} of {} bytes are there", what, taken, size));
  result.resize(size);
  return result;
}

}  // namespace pulson::io
