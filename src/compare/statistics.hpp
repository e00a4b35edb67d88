#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Core>

namespace pulson::compare {

/// Standard deviation of independent values; NaN for fewer than two.
inline double standard_deviation(const Eigen::VectorXd& values) {
  if (values.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt((values.array() - values.mean()).square().sum() / static_cast<double>(values.size() - 1));
}

/// Of their mean.
inline double standard_error(const Eigen::VectorXd& values) {
  return standard_deviation(values) / std::sqrt(static_cast<double>(values.size()));
}

/// Of the sum of independent values.
inline double error_of_sum(const Eigen::VectorXd& values) {
  return std::sqrt(static_cast<double>(values.size())) * standard_deviation(values);
}

/// Nats, and two standard errors: smaller differences do not separate two models. So much the evidence of a number that
/// is not needed is below its maximum in 1 of 70 cohorts, erfc √3.
inline constexpr double kDecisive = 3;

/// @param error of the difference; NaN where it is not known
inline bool is_decisive(double difference, double error) {
  return difference > std::max(kDecisive, std::isnan(error) ? 0.0 : 2 * error);
}

/// Fewer shapes are not judged: three have two differences from their mean, and so one share of a first mode.
inline constexpr std::ptrdiff_t kFewestToJudge = 4;

}  // namespace pulson::compare
