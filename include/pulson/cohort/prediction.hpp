#pragma once

#include <vector>

#include "pulson/cohort/atlas.hpp"

namespace pulson::cohort {

/// Where the missing landmarks of a shape are, given the others.
struct PredictedLandmarks {
  std::vector<int> landmarks;  ///< that are missing, in their order
  Points positions;            ///< d×M, in the coordinates of the shape
  /// Half the width of the central 90 % of each coordinate, d×M.
  Points half_widths;
};

/// A model of how the shapes of a cohort vary, from which missing landmarks are predicted. The displacements from the
/// mean, but for the directions Z of the alignment, are normal with a covariance Σ that has an inverse Wishart prior
/// about that of the atlas,
///
///     Σ ~ IW(δ + m + 1, δV),   V = s(K/λ + σ²),   E Σ = V,
///
/// with m free coordinates. n specimens of scatter S turn this into IW(δ + m + n, δV + S), so that Σ is estimated by
/// (δV + S)/(δ + n − 1): few specimens rely on the kernel, many on what they show. δ and s have the greatest marginal
/// likelihood, which is in closed form (C.-F. Chen, "Bayesian inference for a normal dispersion matrix and its
/// application to stochastic multiple regression analysis", 1979). Another shape has Student's distribution, and so
/// have its missing landmarks given the others; the alignment has a flat prior, as in universal kriging. Specimens that
/// miss landmarks enter by their conditional expectations (EM; A. Dempster, N. Laird and D. Rubin 1977).
class ShapePredictor {
 public:
  /// Cost O((dN)³) for each of some ten rounds where specimens miss landmarks, else once.
  explicit ShapePredictor(const Atlas& atlas);
  /// Of aligned shapes, with the kernel, λ, σ and alignment of an atlas that need not be theirs.
  ShapePredictor(const Atlas& atlas, const std::vector<Points>& aligned);

  double prior_weight() const { return prior_weight_; }  ///< δ, in specimens
  double prior_scale() const { return prior_scale_; }    ///< s
  const Points& mean() const { return mean_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }  ///< Σ, dN×dN, singular along Z

  /// @param shape of the atlas's kind, in any coordinates; landmarks that miss a coordinate are missing
  /// @throws InputError where fewer landmarks are left than the alignment needs
  PredictedLandmarks predict(const Landmarks& shape) const;

 private:
  struct Conditional;
  Conditional condition(const Points& aligned) const;
  void fit(const Atlas& atlas, const std::vector<Points>& aligned);
  void update(const Eigen::MatrixXd& prior, const std::vector<Points>& complete, const Eigen::MatrixXd& uncertain);

  AlignmentKind alignment_;
  Points mean_;
  Eigen::MatrixXd directions_;  ///< Z, dN×r
  Eigen::MatrixXd covariance_;
  double prior_weight_ = 1, prior_scale_ = 1;
  double specimens_ = 0;
  double degrees_ = 1;  ///< of freedom of Student's distribution of a shape
};

/// The missing landmarks of an atlas's own shapes, each predicted by a model that has not seen the shape: specimens
/// that miss landmarks are left out of it by turns, in at most ten parts.
/// @param shapes as the atlas was made of @return one for each shape, empty where none is missing @throws InputError
std::vector<PredictedLandmarks> predict_missing(const Atlas& atlas, const std::vector<Landmarks>& shapes);

/// The quantile of Student's distribution with so many degrees of freedom: t with P(T ≤ t) = p, ½ < p < 1.
double student_quantile(double p, double degrees);

}  // namespace pulson::cohort
