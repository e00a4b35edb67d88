#pragma once

#include <string>
#include <vector>

#include "pulson/io/registration_record.hpp"

namespace pulson {

/// What a registration found, for people, on standard output.
void print_registration(const Registration& registration, const RegistrationFacts& facts);

/// What to beware of, a line each.
std::vector<std::string> warnings(const Registration& registration);

/// The same on standard error. @param asked_noise the noise that was asked for
void print_warnings(const Registration& registration, const std::string& asked_noise);

}  // namespace pulson
