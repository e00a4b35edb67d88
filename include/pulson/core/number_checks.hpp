#pragma once

#include <string_view>

namespace pulson {

/// @throws InputError that says what the number is of
void require_finite(std::string_view what, double value);
void require_positive(std::string_view what, double value);

}  // namespace pulson
