#pragma once

#include <string>
#include <vector>

#include "pulson/records/records.hpp"

namespace pulson {

/// What a registration found, for people, on standard output. @param asked_kernel a specification, or `auto`
void print_registration(const matching::Registration& registration, const records::RegistrationFacts& facts,
                        const std::string& asked_kernel);

}  // namespace pulson
