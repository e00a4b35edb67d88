#pragma once

#include <string_view>

#include <Eigen/Core>

namespace pulson {

/// @throws InputError that says what the number is of
void require_finite(std::string_view what, double value);
void require_positive(std::string_view what, double value);

/// Whether `r` is finite, symmetric and positive definite, up to rounding.
bool is_covariance(const Eigen::MatrixXd& r);

}  // namespace pulson
