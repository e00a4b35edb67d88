#pragma once

#include <string_view>

namespace pulson::html {

/// The script that plays motions, see motion().
std::string_view player_script();

}  // namespace pulson::html
