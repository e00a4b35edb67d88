#pragma once

#include <vector>

#include <Eigen/Core>

#include "newton.hpp"

namespace pulson::compare {

/// The smooth function through values at scattered places: with y = R(x − x₀), RᵀR a metric,
///
///     f(x) = Σ_k w_k |y − y_k|³ + P(y),   Σ_k w_k Q(y_k) = 0 for every Q like P,
///
/// a polyharmonic spline (J. Duchon 1977), with P a polynomial of the second degree, or of a lower one where the places
/// do not determine that.
class ResponseSurface {
 public:
  /// @param places a column each, no two the same @param metric positive definite
  ResponseSurface(const Eigen::MatrixXd& places, const Eigen::VectorXd& values, const Eigen::MatrixXd& metric);

  double operator()(const Eigen::VectorXd& x) const;
  SecondOrder second_order(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd polynomials(const Eigen::VectorXd& y) const;

  Eigen::MatrixXd root_;     // R
  Eigen::VectorXd origin_;   // x₀
  Eigen::MatrixXd centres_;  // y_k
  Eigen::VectorXd weights_;  // w
  int degree_ = 2;
  Eigen::VectorXd coefficients_;
};

}  // namespace pulson::compare
