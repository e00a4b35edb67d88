#pragma once

#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::matching {

/// Landmarks by pivoted Cholesky factorisation of K(q), each where K is explained worst by those before, until the
/// trace of what is left is below a tolerance, or there are so many.
std::vector<Eigen::Index> pivoted_landmarks(const KernelOperator& kernel, const Points& q, double tolerance,
                                            Eigen::Index most);

/// Momenta in whitened coordinates, at as few landmarks as carry them. By pivoted Cholesky factorisation of K(q0),
/// pivots are taken, each where K is explained worst by those before, until the trace of what is left of K, its Schur
/// complement S, is below a tolerance: a momentum at a landmark that is no pivot does what momenta at the pivots do but
/// for a field of norm √S_aa, and no direction of momenta is left out whose field has more than the tolerance. With λK
/// = VDVᵀ at the pivots, p0 = VD^{-½}z0 there and 0 elsewhere, so that the energy (λ/2) p0ᵀK p0 = ½|z0|². (For more
/// than 1200 pivots λK = LLᵀ and p0 = L⁻ᵀz0.)
///
/// Where a matrix A of one number for each pair of landmarks is given, K + A stands for K throughout.
///
/// Directions may fade: p0 = VD^{-½}F z0 with F_i rising from 0 where D_i is a tenth of a given eigenvalue to 1 at ten
/// times that, twice differentiable by log D_i. Those of F_i = 0 are left out, but for the smoothest.
class MomentumBasis {
 public:
  /// @param tolerance of the Schur complement's trace, in units of K
  /// @param faint the eigenvalue of λK at which directions are half faded; 0: none are
  /// @param added A, N×N; empty for none
  MomentumBasis(KernelOperator kernel, const Points& q0, double lambda, double tolerance, double faint = 0,
                Eigen::MatrixXd added = {});

  const std::vector<Eigen::Index>& pivots() const { return pivots_; }
  /// Landmarks with a momentum.
  Eigen::Index rank() const { return factor_.rows(); }
  /// d for each of them, but for those that are faded.
  Eigen::Index unknowns() const { return dimension_ * directions(); }
  /// The trace of the Schur complement left over.
  double left_over() const { return left_over_; }

  Points momenta(const Eigen::VectorXd& z0) const;  ///< p0, d×N, from z0, index pivot·d + axis

  /// The z0 whose field is nearest to that of p, in the norm of K; where a direction has faded to less than a
  /// tenth, nearer to 0.
  Eigen::VectorXd white(const Points& p) const;

  /// The transpose of `momenta`: Σ_a p_a·b_a by z0.
  Eigen::VectorXd pull_back(const Points& p_bar) const;

  /// ∂p0/∂z0, index a·d + axis, dN×unknowns.
  Eigen::MatrixXd changes() const;

  /// Vᵀ of one number for each landmark and axis: of standard normals the same for any λ, for each unknown.
  /// The first of them beyond 1200 pivots.
  Eigen::VectorXd in_directions(const Eigen::VectorXd& normals) const;

  /// The eigenvalue of λK of each unknown's direction; infinite beyond 1200 pivots, where there are no directions.
  Eigen::VectorXd eigenvalues() const;

  /// The spatial frequency of each unknown: the largest eigenvalue of K over that of its direction; 1 beyond 1200
  /// pivots, where there are no directions.
  Eigen::VectorXd frequency() const;

 private:
  Points scatter(const Points& at_pivots) const;
  Eigen::Index directions() const { return eigen_root_.size() > 0 ? eigen_root_.cols() : rank(); }

  KernelOperator kernel_;
  Points q0_;
  double lambda_;
  Eigen::MatrixXd added_;  ///< A
  Eigen::Index dimension_;
  std::vector<Eigen::Index> pivots_;
  Eigen::MatrixXd factor_;        ///< L, lower triangle, of λK at the pivots
  Eigen::VectorXd eigenvalues_;   ///< D, empty beyond 1200 pivots
  Eigen::MatrixXd eigenvectors_;  ///< V
  Eigen::VectorXd strength_;      ///< F
  Eigen::MatrixXd eigen_root_;    ///< VD^{-½}F
  double left_over_ = 0;
};

}  // namespace pulson::matching
