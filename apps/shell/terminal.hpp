#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pulson {

/// What takes the line away on which a terminal's cursor is.
inline constexpr char kEraseLine[] = "\r\x1b[K";

bool is_terminal(int descriptor);

/// Columns of the terminal behind `descriptor`; `otherwise` where it is none.
std::size_t terminal_width(int descriptor, std::size_t otherwise);

enum class Style { kError, kWarning, kNote };

/// `text` in the style's colour where `descriptor` is a terminal that shows colours and nobody set NO_COLOR
/// (no-color.org), else as it is.
std::string painted(Style style, std::string_view text, int descriptor);

/// Characters of UTF-8 text, each of which is taken to be a column wide.
std::size_t columns(std::string_view text);

/// The first `count` characters of UTF-8 text, or all.
std::string first_columns(std::string_view text, std::size_t count);

}  // namespace pulson
