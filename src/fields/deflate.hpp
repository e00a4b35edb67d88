#pragma once

// zlib's streams in memory.

#include <cstddef>
#include <string>
#include <string_view>

namespace pulson::io {

/// `bytes` as a gzip stream, or a zlib stream.
std::string deflated(std::string_view bytes, bool as_gzip);

/// The `size` bytes that the gzip or zlib stream `stream` is of. @throws InputError that begins with `what` if it is
/// damaged, cut off or of another number of bytes; before anything is allocated if it is too short to hold so many
std::string inflated(std::string_view stream, std::size_t size, const std::string& what);

}  // namespace pulson::io
