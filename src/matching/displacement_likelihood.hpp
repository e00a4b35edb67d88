#pragma once

#include <utility>
#include <vector>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::matching {

/// Widths of kernels that are fitted to displacements, in diameters: docs/matching.md, "Kernel", has what they rest on.
inline constexpr double kNarrowestFit = 0.1, kWidestFit = 0.4;

/// At most 128 of `count` landmarks, every few: what the matrices of a fit hold.
std::vector<Eigen::Index> fitted_landmarks(Eigen::Index count);

/// The same matrix on each axis, dN×dN of N×N (index a·d + axis).
Eigen::MatrixXd on_each_axis(const Eigen::MatrixXd& matrix, Eigen::Index d);

/// Displacements of the landmarks of one shape.
struct DisplacementDraws {
  Points shape;                ///< d×N
  Eigen::MatrixXd columns;     ///< dN×m, whose outer products sum to Σ_i r_ir_iᵀ
  Eigen::MatrixXd directions;  ///< Z of the alignment, dN×r, or any other basis of their span
  Eigen::Index count = 1;      ///< of independent r_i: of n distances from their mean n − 1
};

/// The restricted likelihood (REML; H. Patterson and R. Thompson 1971) of independent displacements r_i, which are on
/// each axis N(0, V) with V = K(q)/λ + σ², but for what the alignment took out of them, which is integrated out:
///
///     −½ [count (log det V + log det ZᵀV⁻¹Z) + Σ_i r_iᵀPr_i],   P = V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹,
///
/// up to a constant. Of one kernel: O(N³) to make, then O(dN(r² + m)) a place.
class DisplacementLikelihood {
 public:
  DisplacementLikelihood(const KernelOperator& kernel, const DisplacementDraws& draws)
      : DisplacementLikelihood(kernel.gram(draws.shape, draws.shape), draws) {}

  /// The same of another matrix K, such as that of observations of unequal precision, which are multiplied by the roots
  /// of their precisions. @param gram N×N of each axis, or dN×dN of all coordinates
  DisplacementLikelihood(const Eigen::MatrixXd& gram, const DisplacementDraws& draws);

  /// @param tau λσ² @param variance 1/λ
  double operator()(double tau, double variance) const;

  /// The 1/λ of greatest likelihood for this λσ².
  double best_variance(double tau) const { return terms(tau).second / degrees(); }

 private:
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& vectors) const;
  std::pair<double, double> terms(double tau) const;
  double degrees() const;

  Eigen::Index dimension_, count_, size_;
  Eigen::VectorXd values_, squares_;
  Eigen::MatrixXd columns_, directions_;
};

}  // namespace pulson::matching
