#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pulson {

/// CRC-32 (ISO 3309, that of gzip and png) of the bytes.
std::uint32_t crc32_of(std::string_view bytes);

/// The same as eight hexadecimal digits: `0a1b2c3d`.
std::string crc32_text(std::string_view bytes);

/// The bytes followed by their CRC-32 in four bytes, the most significant first. Every change of up to 32 successive
/// bits is noticed, and of other changes all but one in 2³².
std::string sealed(std::string bytes);

/// Takes that checksum off again. @return whether it is there and is that of the bytes
bool unseal(std::string_view& bytes);

}  // namespace pulson
