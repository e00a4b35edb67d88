#pragma once

#include <Eigen/Cholesky>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// The quadratic model ½|z + δ|² + ½|r + Jδ|² + ½μ δᵀRδ of a cost at z, R diagonal: B = I + μR + JᵀJ is factored in
/// the space of the unknowns or, where these are more than the residuals, in that of the data: with C = (I + μR)⁻¹
/// and S = I + JCJᵀ, B⁻¹ = C − CJᵀS⁻¹JC.
class QuadraticModel {
 public:
  /// Holds references: `at` and `frequency` must outlive it.
  QuadraticModel(const MatchingObjective::Linearisation& at, const Eigen::VectorXd& frequency);

  void set_damping(double mu);

  /// The δ of the minimum.
  Eigen::VectorXd step(const Eigen::VectorXd& z) const;

  /// The least change that takes a residual `excess`, which the linear model did not foresee, out again.
  Eigen::VectorXd correction(const Eigen::VectorXd& excess) const;

  /// B⁻¹v.
  Eigen::VectorXd solve(const Eigen::VectorXd& v) const;

  /// The diagonal of A B⁻¹ Aᵀ: with B⁻¹ the covariance of the unknowns, the variances of A times them. In the space of
  /// the data as W = B⁻¹Aᵀ, diag(WᵀBW), a sum of squares: nothing cancels where the data say nearly all.
  /// @param transposed Aᵀ, unknowns × n
  Eigen::VectorXd variances(const Eigen::MatrixXd& transposed) const;

  /// log det B.
  double log_determinant() const;

 private:
  bool in_data_space() const { return at_.jacobian.cols() > at_.jacobian.rows(); }
  Eigen::VectorXd pull(const Eigen::VectorXd& r) const;

  const MatchingObjective::Linearisation& at_;
  const Eigen::VectorXd& frequency_;
  Eigen::MatrixXd normal_;  ///< JᵀJ, in the space of the unknowns
  Eigen::VectorXd c_;
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

}  // namespace pulson::matching
