#pragma once

#include <string>

namespace pulson {

/// The project's version, as in "0.1.0".
std::string version();

}  // namespace pulson
