#pragma once

#include <string>
#include <vector>

#include "pulson/io/registration_record.hpp"

namespace pulson {

/// What a registration found, for people, on standard output.
void print_registration(const Registration& registration, const RegistrationFacts& facts);

}  // namespace pulson
