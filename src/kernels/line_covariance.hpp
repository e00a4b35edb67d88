#pragma once

#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// The matrix K + R of a kernel of one Matérn term (the peakon is that of order 1/2) between places on a line, R
/// diagonal: its solutions and its determinant in O(N) beyond sorting.
///
/// A process with the covariance K is the first component of a state (f, f', …)/(c/α)^k of 1, 2 or 3 numbers that obeys
/// a linear differential equation driven by white noise (Hartikainen and Särkkä 2010). The Kalman filter over the
/// sorted places gives K + R = L D Lᵀ: the innovations of v are L⁻¹v, their variances D; its adjoint, from right to
/// left, gives L⁻ᵀ. The variance of the driving noise between two places is an integral of positive terms, exact
/// however near they are.
class LineCovariance {
 public:
  /// @param term not gaussian @param x finite @param noise the diagonal of R, N numbers, none below 0
  LineCovariance(const KernelTerm& term, const Eigen::VectorXd& x, const Eigen::VectorXd& noise);

  /// Whether all innovations have a variance above 0.
  bool is_regular() const { return regular_; }

  /// log det(K + R)
  double log_determinant() const { return variances_.array().log().sum(); }

  double least_variance() const { return variances_.minCoeff(); }  ///< of an innovation

  /// v ← (K + R)⁻¹v, for each column of N numbers.
  void solve_in_place(Eigen::Ref<Eigen::MatrixXd> v) const;

 private:
  friend class LineSteps;

  template <int S>
  void filter(const KernelTerm& term, const Eigen::VectorXd& x, const Eigen::VectorXd& noise);
  template <int S>
  void solve_column(Eigen::Ref<Eigen::VectorXd> v) const;

  int size_;                         ///< of the state
  std::vector<Eigen::Index> order_;  ///< from left to right
  Eigen::VectorXd gaps_, decays_;    ///< before each place in this order: h = c Δx/α, and exp(−h)
  Eigen::VectorXd variances_;        ///< D
  Eigen::MatrixXd gains_;            ///< of the filter, S×N
  bool regular_ = true;
};

}  // namespace pulson
