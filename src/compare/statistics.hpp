#pragma once

#include <algorithm>
#include <cmath>
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

/// Whether a difference of scores separates two models: above 3 nats and two of its standard errors, where it has one.
inline bool is_decisive(double difference, double error) {
  return difference > std::max(3.0, std::isfinite(error) ? 2 * error : 0.0);
}

}  // namespace pulson::compare
