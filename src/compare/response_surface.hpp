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

  /// A smooth function near values with errors, of variance inverse to these weights: a smoothing spline, with w such
  /// that f(x_k) = value_k − μ w_k/weight_k, and μ such that values left out are predicted best.
  ResponseSurface(const Eigen::MatrixXd& places, const Eigen::VectorXd& values, const Eigen::MatrixXd& metric,
                  const Eigen::VectorXd& weights);

  double operator()(const Eigen::VectorXd& x) const;
  SecondOrder second_order(const Eigen::VectorXd& x) const;

  /// f(x) through values at these places is the product of these weights with the values.
  static Eigen::VectorXd weights_at(const Eigen::VectorXd& x, const Eigen::MatrixXd& places,
                                    const Eigen::MatrixXd& metric);

 private:
  ResponseSurface(const Eigen::MatrixXd& places, const Eigen::MatrixXd& metric);
  /// Chooses the degree. @return Q(y_k), a row for each place
  Eigen::MatrixXd choose_polynomials(const Eigen::VectorXd& weights);
  Eigen::MatrixXd system(const Eigen::MatrixXd& tail) const;
  static Eigen::VectorXd right_side(const Eigen::VectorXd& values, Eigen::Index polynomials);
  void take(const Eigen::VectorXd& solution);
  Eigen::VectorXd polynomials(const Eigen::VectorXd& y) const;
  Eigen::VectorXd distances_cubed(const Eigen::VectorXd& y) const;

  Eigen::MatrixXd root_;     // R
  Eigen::VectorXd origin_;   // x₀
  Eigen::MatrixXd centres_;  // y_k
  Eigen::VectorXd weights_;  // w
  int degree_ = 2;
  Eigen::VectorXd coefficients_;
};

}  // namespace pulson::compare
