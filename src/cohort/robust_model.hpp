#pragma once

#include <optional>
#include <vector>

#include "displacement_fit.hpp"
#include "posed_shapes.hpp"
#include "pulson/matching/robust_loss.hpp"

namespace pulson::cohort {

/// Weights of the landmarks of a cohort by their prediction from the others of their shape, and what is expected of the
/// shapes with these. With σ²/v_ia the variance of the noise of landmark a of shape i, and P_i the information of the
/// shape on the mean (PosedShapes::Conditional), the landmark is away from its prediction by
///
///     u_ia = (P_aa)⁻¹(Pr)_a,   t_ia² = u_iaᵀC_ia⁻¹u_ia/c_a,   C_ia = (P_aa)⁻¹ − σ²/v_ia + σ²,
///
/// and has the weight w_ia = w(t_ia²), v_ia = w_ia/κ (LossWeight). Some landmarks vary more than a stationary kernel
/// says: c_a is the median of t_ia² over i beside that of χ², at least 1. The residuals of a fit would not do, as the
/// flow bends to a wrong landmark (D. Hawkins and N. Cressie, "Robust kriging", 1984).
///
/// Weights v enter predictions and poses. A landmark of w below kSuspectWeight counts as missing; kernel, λ, σ and mean
/// are those of the others, all in full: their scatter weighted by w, whatever its scale, is not that of K/λ + σ², and
/// with σ near 0 the weights alone would show as noise.
class RobustShapes {
 public:
  /// @param count of shapes
  RobustShapes(const matching::RobustLoss& loss, const Points& mean, std::size_t count);

  /// Weights under this law, and what is expected of the shapes. @param shapes d×N in any coordinates, missing
  /// landmarks NaN @param least of c; none: what the median of all t² shows, which wrong landmarks do not raise
  ExpectedShapes update(const PosedShapes& law, const std::vector<Points>& shapes, std::optional<double> least);

  /// Another loss for the rounds to come.
  void take(const matching::RobustLoss& loss);

  /// w, N of each shape; 1 for a landmark that is missing
  const std::vector<Eigen::VectorXd>& weights() const { return weights_; }
  /// v, N; 0 where the landmark counts as missing
  Eigen::VectorXd precision(std::size_t shape) const;

 private:
  struct Prediction;
  Prediction predict(const PosedShapes& law, const Points& shape, std::size_t i) const;

  Eigen::Index dimension_;
  matching::LossWeight weight_;
  std::vector<Eigen::VectorXd> weights_;
};

/// Weights and model in turn until the model settles. @param shapes d×N in any coordinates, missing landmarks NaN
/// @param mean gives pose and size of the model @param least of c, as in update() @param model where to begin, and the
/// result @return what is expected of the shapes, in the coordinates of those given
std::vector<Points> settle(RobustShapes& robust, const std::vector<Points>& shapes, Points mean,
                           const CohortFitOptions& options, std::optional<double> least, CohortDisplacements& model);

}  // namespace pulson::cohort
