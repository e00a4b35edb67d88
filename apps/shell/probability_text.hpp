#pragma once

#include <cstdint>
#include <string>

#include "pulson/core/estimate.hpp"

namespace pulson {

/// A number down to the second digit of its error: "0.2800 ± 0.0045", or "3.10e-07 ± 6.6e-08" where both are small.
std::string value_with_error(double value, double error);

/// The same of a probability, from so many independent trials; where none or all of them are counted the bound that
/// holds with 95 %, as the standard error is 0 and says nothing; "undetermined" where there is no trial.
std::string probability_text(const Estimate& estimate, std::int64_t trials);

}  // namespace pulson
