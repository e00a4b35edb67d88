#pragma once

#include <string>
#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson {

/// What a user of the result should know, a line each, the likeliest remedy first: not converged, not matched. Every
/// verb that reads a registration repeats them.
std::vector<std::string> registration_warnings(const Registration& registration);

}  // namespace pulson
