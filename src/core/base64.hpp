#pragma once

#include <string>
#include <string_view>

namespace pulson {

/// RFC 4648.
std::string base64(std::string_view bytes);

}  // namespace pulson
