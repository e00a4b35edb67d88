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

/// A positive number with its standard deviation, or where that of its logarithm is above 1 with its interval of 90 %,
/// of which an end may be missing (0, ∞): "0.084 (± 33 %)", "0.04 (0.0031 to 0.51)", "3.2 (at least 1.1)".
std::string positive_number_text(double value, double log_deviation, double low, double high);

/// The same where the logarithm has a normal law; "undetermined" where its deviation is NaN, or the interval is wider
/// than a search for the number, a factor of 100 either way.
std::string positive_number_text(double value, double log_deviation);

}  // namespace pulson
