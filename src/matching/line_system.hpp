#pragma once

#include <vector>

#include <Eigen/Cholesky>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::matching {

/// R + Σ_k W_k K(x_k) W_k of N landmarks on a line that are at places x_k in step k, k = 1 … n, W_k and R diagonal, K
/// of one Matérn term: solved in O(N (n m)²), m the moments of the term.
///
/// The fields of all steps together are one process along the line, of n·m numbers (see LineCovariance), which a
/// landmark observes as their sum: a Kalman filter over the landmarks, from left to right, factorises the matrix
/// exactly. That takes an order that all steps share. Landmarks that break it, as few as bring the others into one
/// order, are solved for by their Schur complement: with M of them, in O(NM(n m)) + O(M³), and O(NM) memory.
class LineSystem {
 public:
  /// @param places x, N×n @param weights diagonals of W, N×n @param noise diagonal of R, positive
  LineSystem(const KernelTerm& term, const Eigen::MatrixXd& places, const Eigen::MatrixXd& weights,
             const Eigen::VectorXd& noise);

  /// How many landmarks break the order.
  Eigen::Index movers() const { return static_cast<Eigen::Index>(movers_.size()); }

  /// v ← M⁻¹v, M the matrix.
  void solve_in_place(Eigen::VectorXd& v) const;

 private:
  void arrange(const KernelTerm& term, const Eigen::MatrixXd& places);
  void complement(const KernelTerm& term, const Eigen::MatrixXd& places, const Eigen::MatrixXd& weights,
                  const Eigen::VectorXd& noise);
  template <int S>
  void filter(double weight, const Eigen::MatrixXd& weights, const Eigen::VectorXd& noise);
  void solve_ordered(Eigen::Ref<Eigen::MatrixXd> v) const;  ///< rows of order_
  template <int S>
  void solve_column(Eigen::Ref<Eigen::VectorXd> v) const;

  std::vector<Eigen::Index> order_;   ///< landmarks from left to right, but those that break it
  std::vector<Eigen::Index> movers_;  ///< these
  // n, rounded up to whole lanes, which hold zeros, × N.
  Eigen::MatrixXd gaps_, decays_;  ///< before each landmark of this order: h, and exp(−h)
  Eigen::MatrixXd weights_;
  Eigen::VectorXd variances_;           ///< of innovations
  std::vector<Eigen::MatrixXd> gains_;  ///< of the filter, m
  Eigen::MatrixXd solved_;              ///< of the columns of movers, what the filter makes of their rows in order_
  Eigen::LLT<Eigen::MatrixXd> schur_;
  int moments_;
};

}  // namespace pulson::matching
