#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace pulson {

/// RFC 4648.
std::string base64(std::string_view bytes);

/// The bytes that the text is of, group by group of four letters: texts may follow each other, each with its own `=`.
/// Nothing where it holds anything else.
std::optional<std::string> bytes_of_base64(std::string_view text);

}  // namespace pulson
