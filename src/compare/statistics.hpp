#pragma once

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

}  // namespace pulson::compare
