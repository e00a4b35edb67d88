#pragma once

#include <cstddef>
#include <string_view>

namespace pulson::picture {

/// Bytes of the UTF-8 sequence that starts at byte `i`, 0 if it is broken.
std::size_t utf8_length(std::string_view text, std::size_t i);

}  // namespace pulson::picture
