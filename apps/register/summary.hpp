#pragma once

#include <string>
#include <vector>

#include "pulson/records/records.hpp"

namespace pulson {

/// What a registration found, for people, on standard output. @param asked_kernel a specification, or `auto`
void print_registration(const matching::Registration& registration, const records::RegistrationFacts& facts,
                        const std::string& asked_kernel);

/// Landmarks to which a loss gives little weight, as in "landmarks 7 (weight 0.02) and 12 (0.05)"; empty where there
/// are none.
std::string suspects_text(const matching::Registration& registration);

}  // namespace pulson
