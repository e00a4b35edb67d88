#pragma once

#include <string>

#include "pulson/io/registration_record.hpp"

namespace pulson {

/// What a registration found, for people, on standard output.
void print_registration(const Registration& registration, const RegistrationFacts& facts);

/// What to beware of, on standard error. @param asked_noise the noise that was asked for
void print_warnings(const Registration& registration, const std::string& asked_noise);

}  // namespace pulson
