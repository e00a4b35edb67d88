#pragma once

#include <cmath>
#include <limits>

namespace pulson {

/// What is not defined, such as the diagnostics of draws that do not change.
inline constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// The logarithm of the probability of what cannot be.
inline constexpr double kImpossible = -std::numeric_limits<double>::infinity();

/// The larger and the smaller of two numbers, undefined where either is: std::max and std::fmax pass over NaN, and the
/// worst of several diagnostics would be that of those that happen to be defined.
inline double max_or_undefined(double a, double b) {
  return std::isnan(a) || std::isnan(b) ? kUndefined : std::fmax(a, b);
}
inline double min_or_undefined(double a, double b) {
  return std::isnan(a) || std::isnan(b) ? kUndefined : std::fmin(a, b);
}

/// Below this is, with 95 % confidence, the probability of what happened in none of so many independent trials, about 3
/// over their number: 1 − 0.05^(1/n). Their standard error, 0, says nothing.
inline double unseen_below(double trials) { return -std::expm1(std::log(0.05) / trials); }

}  // namespace pulson
