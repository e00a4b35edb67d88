#pragma once

#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::matching {

/// R + Σ_k W_k K(x_k) W_k of N landmarks on a line that are at places x_k in step k, k = 1 … n, W_k and R diagonal, K
/// of one Matérn term: solved in O(N (n m)²), m the moments of the term.
///
/// The fields of all steps together are one process along the line, of n·m numbers (see LineCovariance), which a
/// landmark observes as their sum: a Kalman filter over the landmarks, from left to right, factorises the matrix
/// exactly. That takes an order that all steps share. Where landmarks change their order, each step's places are put in
/// ascending order, and the filter is of a matrix nearby.
class LineSystem {
 public:
  /// @param places x, N×n @param weights diagonals of W, N×n @param noise diagonal of R, positive
  LineSystem(const KernelTerm& term, const Eigen::MatrixXd& places, const Eigen::MatrixXd& weights,
             const Eigen::VectorXd& noise);

  /// Whether all steps share one order.
  bool is_exact() const { return exact_; }

  /// v ← M⁻¹v, M the matrix of the filter.
  void solve_in_place(Eigen::VectorXd& v) const;

 private:
  void arrange(const KernelTerm& term, const Eigen::MatrixXd& places);
  template <int S>
  void filter(double weight, const Eigen::MatrixXd& weights, const Eigen::VectorXd& noise);
  template <int S>
  void solve_with(Eigen::VectorXd& v) const;

  std::vector<Eigen::Index> order_;  ///< landmarks from left to right
  Eigen::MatrixXd gaps_, decays_;    ///< n×N, before each landmark of this order: h, and exp(−h)
  Eigen::MatrixXd weights_;          ///< n×N
  Eigen::VectorXd variances_;        ///< of innovations
  Eigen::MatrixXd gains_;            ///< of the filter, n·m×N
  int moments_;
  bool exact_ = true;
};

}  // namespace pulson::matching
