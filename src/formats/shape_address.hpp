#pragma once

#include <string>

namespace pulson::formats {

/// The path in the address of a shape: `a.tps` of `a.tps#3`, unless there is a file of the whole name.
std::string file_of_address(const std::string& address);

}  // namespace pulson::formats
