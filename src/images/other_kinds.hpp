#pragma once

#include <string>
#include <string_view>

namespace pulson::images {

/// What a file is that holds pictures but in a format that is not read, with the way out, as "a webp picture; …"; empty
/// where its first bytes do not say. @param bytes the file or its beginning
std::string other_kind(std::string_view bytes);

}  // namespace pulson::images
