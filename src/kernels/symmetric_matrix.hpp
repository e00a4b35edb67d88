#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace pulson {

/// Products with a symmetric matrix and solves with its Cholesky factor for a few vectors at a time, such as the axes
/// of landmarks in space: what limits them is to read the matrix, so each does it once for all vectors, where BLAS
/// reads it once for each of them or copies it. Vectorised with run-time dispatch; the rounding depends on the target.

/// LLᵀ = A in place, by LAPACK: the lower triangle of `matrix` is replaced by L, the part above the diagonal is kept.
/// @return false where A is not positive definite to working accuracy
bool factorise_in_place(Eigen::MatrixXd& matrix);

/// Ax, N×M. @param matrix holds A above its diagonal @param diagonal of A
Eigen::MatrixXd symmetric_product(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& diagonal,
                                  const Eigen::MatrixXd& x);

/// A⁻¹x in place of x, N×M. @param matrix holds L, LLᵀ = A, on and below its diagonal
void solve_factorised(const Eigen::MatrixXd& matrix, Eigen::MatrixXd& x);

/// Columns of one matrix, N×M, of which `m` at most 3 are multiplied at a time: what the vector code takes.
struct ThinProduct {
  const double* matrix = nullptr;
  std::size_t stride = 0;  ///< of the columns of the matrix
  std::size_t size = 0;    ///< N
  const double* x = nullptr;
  double* y = nullptr;  ///< columns follow one another, N apart, as those of x
  int columns = 1;      ///< m
};

}  // namespace pulson
