#pragma once

#include <cmath>

namespace pulson::inference {

/// Φ, the distribution function of a standard normal number.
inline double normal_probability(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

/// Φ⁻¹(p), 0 < p < 1, to about 1e-15: P. Acklam's rational approximation and one step of Halley's method.
double normal_quantile(double p);

}  // namespace pulson::inference
