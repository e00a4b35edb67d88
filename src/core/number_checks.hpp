#pragma once

#include <string_view>

#include <Eigen/Core>

namespace pulson {

/// @throws InputError that says what the number is of
void require_finite(std::string_view what, double value);
void require_positive(std::string_view what, double value);

/// Whether `r` is finite, symmetric and positive definite, up to rounding.
bool is_covariance(const Eigen::MatrixXd& r);

/// @throws InputError that says what the matrix is of, its size and the size that it must have
void require_size(std::string_view what, Eigen::Index rows, Eigen::Index columns, Eigen::Index needed_rows,
                  Eigen::Index needed_columns);

/// The same for a matrix or vector.
template <class Matrix>
void require_size(std::string_view what, const Eigen::EigenBase<Matrix>& matrix, Eigen::Index needed_rows,
                  Eigen::Index needed_columns) {
  require_size(what, matrix.rows(), matrix.cols(), needed_rows, needed_columns);
}

}  // namespace pulson
