#pragma once

#include <optional>

#include "pulson/core/alignment.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// What is given before the width and weight of the model are fitted.
struct DisplacementOptions {
  KernelProfile profile = KernelProfile::kMatern32;
  AlignmentKind alignment = AlignmentKind::kNone;  ///< that was taken out of the displacements, and has a flat prior
  double sigma = 0;                ///< standard deviation of an observed coordinate, length units; must be given
  std::optional<double> lambda{};  ///< none: fitted
};

/// A kernel and the weight of the energy, fitted to one pair of shapes.
struct DisplacementModel {
  KernelTerm kernel;
  double lambda = 1;            ///< 1/(length units)²: displacements have the standard deviation λ^{-½}
  double log_likelihood = 0;    ///< restricted, up to a constant
  double prediction_error = 0;  ///< root mean square distance of a left-out landmark from its prediction, length units
  double alignment_error = 0;   ///< the same of its prediction by the alignment alone
  Eigen::Index landmarks = 0;   ///< that it was fitted to
};

/// Fits the linearised matching problem to the displacements y − q0 of the landmarks: to first order in the momenta
/// p0 ~ N(0, (λK)⁻¹), each axis of the displacement is a Gaussian process over q0,
///
///     y − q0 = Zb + f + e,   f ~ N(0, K_α(q0)/λ),   e ~ N(0, σ²),
///
/// with the directions Z of the alignment (motion_directions()) and any b. α and λ maximise the restricted likelihood
/// (REML; H. Patterson and R. Thompson 1971), in which b is integrated out:
///
///     −½ [log det V + log det ZᵀV⁻¹Z + rᵀPr],   V = K/λ + σ²I,   P = V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹
///
/// over widths of 0.1 to 0.4 diameters of q0 in steps of a fifth. Narrower kernels, which dense outlines would take,
/// move landmarks individually and leave the space between them in place. The prediction errors are those of universal
/// kriging, exact without refitting b and f: |(P_aa)⁻¹(Pr)_a| for landmark a.
///
/// Landmarks that have a missing coordinate in either shape are left out; of more than 128 landmarks every few are
/// taken.
/// @param source d×N, after the alignment @param target d×N
/// @return none where there are fewer than four coordinates more than directions of the alignment
/// Cost O(n³) for n ≤ 128 landmarks, some 20 times.
std::optional<DisplacementModel> fit_displacements(const Points& source, const Points& target,
                                                   const DisplacementOptions& options);

}  // namespace pulson
