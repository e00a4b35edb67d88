#pragma once

#include <string_view>

namespace pulson::html {

/// The style sheet of a report.
std::string_view style();

/// What motions add to it, see motion().
std::string_view player_style();

/// The script that sorts tables. Without it, a page loses nothing else.
std::string_view script();

}  // namespace pulson::html
