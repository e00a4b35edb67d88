#pragma once

#include <memory>
#include <vector>

#include "pulson/cohort/atlas.hpp"

namespace pulson::cohort {

/// Where the missing landmarks of a shape are, given the others.
struct PredictedLandmarks {
  std::vector<int> landmarks;  ///< that are missing and not absent, in their order
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
/// application to stochastic multiple regression analysis", 1979).
///
/// Specimens that miss landmarks enter by their conditional expectations and covariances (EM; A. Dempster, N. Laird and
/// D. Rubin 1977). Each round estimates all of it: the pose of each specimen by generalised least squares under Σ, as
/// the motion of the mean that is nearest to it; the expected scatter; the mean, whose pose and size are held; δ, s and
/// Σ. Another shape has Student's distribution, and so have its missing landmarks given the others; the pose has a flat
/// prior, as in universal kriging. To the covariance of a prediction that of the mean is added, the inverse of the
/// information in the landmarks observed, and its degrees of freedom are δ + 1 more than the number of specimens that
/// have the landmark and of the coordinates that predict it.
class ShapePredictor {
 public:
  /// Cost O((dN)³) for each specimen that misses landmarks in each of some ten rounds.
  explicit ShapePredictor(const Atlas& atlas);
  /// Of shapes in any pose, with the kernel, λ, σ and alignment of an atlas that need not be theirs.
  ShapePredictor(const Atlas& atlas, const std::vector<Points>& shapes);

  double prior_weight() const;  ///< δ, in specimens
  double prior_scale() const;   ///< s
  const Points& mean() const;
  const Eigen::MatrixXd& covariance() const;  ///< Σ, dN×dN, singular along Z

  /// @param shape of the atlas's kind, in any coordinates; landmarks that miss a coordinate are missing
  /// @throws InputError where fewer landmarks are left than the alignment needs
  PredictedLandmarks predict(const Landmarks& shape) const;

 private:
  struct Fit;
  void fit(const Atlas& atlas, const std::vector<Points>& shapes);

  std::shared_ptr<const Fit> fit_;
};

/// The missing landmarks of an atlas's own shapes, each predicted by a model that has not seen the shape: specimens
/// that miss landmarks are left out of it by turns, in at most ten parts.
/// @param shapes as the atlas was made of @return one for each shape, empty where none is missing @throws InputError
std::vector<PredictedLandmarks> predict_missing(const Atlas& atlas, const std::vector<Landmarks>& shapes);

/// The quantile of Student's distribution with so many degrees of freedom: t with P(T ≤ t) = p, ½ < p < 1.
double student_quantile(double p, double degrees);

}  // namespace pulson::cohort
