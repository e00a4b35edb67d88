#pragma once

#include <optional>
#include <vector>

#include <Eigen/SparseCore>

#include "pulson/matching/data_term.hpp"

namespace pulson {

/// Where landmarks were observed, and how well.
struct LandmarkObservations {
  Points target;              ///< y, d×N; a NaN is a coordinate that was not observed
  double sigma = 0;           ///< standard deviation of a coordinate, length units; must be given without covariances
  Eigen::VectorXd weights{};  ///< w, N numbers; empty: all 1; a landmark of weight 0 is left out
  std::vector<Eigen::MatrixXd> covariances{};  ///< R, N matrices d×d, length units squared; empty: σ²I
};

/// Landmarks observed with Gaussian errors,
///
///     D(q) = ½ Σ_a w_a (q_a − y_a)ᵀ R_a⁻¹ (q_a − y_a),
///
/// where of a landmark that was observed in part R_a is cut down to the coordinates that were: its marginal. With
/// R_a = LLᵀ the residual is r_a = √w_a L⁻¹(q_a − y_a).
class LandmarkTerm final : public DataTerm {
 public:
  /// @throws InputError if sizes do not fit together, sigma, a weight or a covariance is none, a coordinate is
  /// infinite, or nothing is observed
  explicit LandmarkTerm(const LandmarkObservations& observations);

  double value(const Points& q) const override;
  Points gradient(const Points& q) const override;
  Linearisation linearise(const Points& q, const Eigen::MatrixXd& changes) const override;
  bool is_least_squares() const override { return true; }
  Eigen::VectorXd residual(const Points& q) const override;

  const LandmarkTerm* landmarks() const override { return this; }

  /// y, d×N, with 0 for what is not observed.
  Points target() const { return target_.reshaped(dimension_, target_.size() / dimension_); }

  /// w_a R_a⁻¹, d×d, with rows and columns of 0 for what is not observed.
  Eigen::MatrixXd precision(Eigen::Index a) const;

  /// The same with other targets: y + shift. @param shift d×N, length units
  LandmarkTerm moved(const Points& shift) const;

  /// Some of the landmarks, in the order given, with `weight` times their weights.
  /// @throws InputError if of these nothing is observed
  LandmarkTerm part(const std::vector<Eigen::Index>& landmarks, double weight) const;

  /// The length of r: how many coordinates are observed, with a weight above 0.
  Eigen::Index residuals() const { return whitening_.rows(); }

  /// Σ_a log det(2πR_a/w_a) over what is observed: −log of the density of y given q is D(q) plus half of it.
  double log_determinant() const { return log_determinant_; }

 private:
  LandmarkObservations observations_;
  Eigen::Index dimension_;
  Eigen::VectorXd target_;                 ///< y, dN, with 0 for what is not observed
  Eigen::SparseMatrix<double> whitening_;  ///< F, of the blocks √w_a L⁻¹; by columns, which precision() takes
  std::optional<double> scale_;            ///< s where F = sI
  double log_determinant_ = 0;
};

/// |q_a − y_a| of each landmark over the coordinates observed, NaN where there are none. @param q, target d×N
Eigen::VectorXd distances(const Points& q, const Points& target);

/// The root mean square of those distances that there are; NaN where there are none.
double rms_distance(const Points& q, const Points& target);

}  // namespace pulson
