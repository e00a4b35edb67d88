#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace pulson::text {

/// "a, b, c"; of more than `most` names the first, and how many follow: "a, b and 7 more".
std::string first_of(std::vector<std::string> names, std::size_t most);

}  // namespace pulson::text
