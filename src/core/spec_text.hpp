#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/name_table.hpp"

namespace pulson {

/// The parts between separators, empty ones too.
std::vector<std::string_view> split(std::string_view text, char separator);

/// The terms of `NAME:...+NAME:...`; a '+' separates where a letter follows it, so 1e+3 is a number.
std::vector<std::string_view> split_spec_sum(std::string_view text);

/// `NAME:key=value,key=value`, as parse_spec_sum() reads it.
std::string text_of_spec(const Spec& spec);

}  // namespace pulson
