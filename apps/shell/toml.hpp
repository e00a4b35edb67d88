#pragma once

#include <string>
#include <string_view>

#include "config_file.hpp"

namespace pulson {

/// See read_config_file. `path` is what messages call the file. @throws InputError
ConfigFile read_toml_config(const std::string& path, std::string_view text);

/// `text` as a TOML string.
std::string toml_string(std::string_view text);

/// Whether `text` is a TOML number as it stands.
bool is_toml_number(const std::string& text);

}  // namespace pulson
