#pragma once

#include <vector>

#include "landmark_law.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// The directions about a mean shape that a similarity leaves, and the kernels' covariances in them: what laws of the
/// same shapes share.
struct ShapeDirections {
  struct Kernel {
    Eigen::MatrixXd precision;  ///< m×m
    double log_determinant;     ///< of the covariance
  };

  explicit ShapeDirections(const Points& reference_shape);

  Points reference;       ///< d×N, complete
  Eigen::MatrixXd basis;  ///< Q, dN×m
  std::vector<Kernel> kernels;
};

/// The law of one shape of a cohort by the others. Of displacements z_i from their weighted mean, in the m directions
/// that a similarity leaves, the covariance has an inverse Wishart prior about the kernel of greatest likelihood,
///
///     Σ ~ W⁻¹(Ψ, ν0),   Ψ = (ν0 − m − 1)gG,   so that   A = Ψ + Σ_j w_j z_jz_jᵀ
///
/// has the mean covariance as a multiple; kernel, g and ν0 are those of greatest evidence, in closed form. The shape
/// that is judged is left out, of the mean and of A, by one rank. Weights are those of Huber (1964), and 0 of shapes
/// already accused. How heavy the tails are is fitted to the shapes, each judged by the others: of whole shapes the
/// degrees of a Student distribution, and those of one landmark given the others.
class CohortLaw {
 public:
  /// @param shapes d×N each, NaN where a landmark is missing @param directions about a first mean; is kept, not copied
  /// @param accused shapes that have no weight, as many as shapes
  CohortLaw(const std::vector<Points>& shapes, const ShapeDirections& directions, const std::vector<bool>& accused);

  const Points& reference() const { return reference_; }
  /// Of the shape in place i by the others.
  LandmarkLaw law_without(std::size_t i) const;
  /// Median over the shapes of their root mean square distance from the mean, units of reference().
  double typical_distance() const;

 private:
  void fill_in();
  void fit();
  void weigh();
  void fit_tails();
  LandmarkLaw::Member member_without(std::size_t i) const;

  const Eigen::MatrixXd& directions() const { return directions_of_mean_->basis; }

  const ShapeDirections* directions_of_mean_;
  Points reference_;
  std::vector<std::vector<int>> missing_;  // of each shape
  Eigen::MatrixXd displacements_;          // dN×n, with predictions where landmarks are missing
  Eigen::VectorXd weights_;
  std::vector<bool> is_accused_;
  Eigen::MatrixXd precision_;       // QA⁻¹Qᵀ
  double log_determinant_ = 0;      // of A
  double prior_degrees_ = 0;        // ν0
  double degrees_ = 0, scale_ = 1;  // ν, κ/ν
  LandmarkLaw::Tail tail_;
};

}  // namespace pulson::audit
