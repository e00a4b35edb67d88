#pragma once

#include "pulson/matching/objective.hpp"

namespace pulson {

/// The posterior of a match near its minimum as a Gaussian, and how well the model explains the data.
struct LaplaceApproximation {
  Points momentum_deviation;  ///< standard deviations of p0, d×N; 0 at landmarks without a momentum of their own
  Points velocity_deviation;  ///< of v0 = K(q0)p0 at the landmarks, d×N: well conditioned where momenta are not
  Points end_deviation;       ///< of q(T), d×N, length units; of several realisations: of the mean of their ends
  double log_evidence = 0;    ///< log p(y), see log_evidence(); NaN where the data have no normalised density
};

/// Laplace's approximation (D. MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 27) of the
/// posterior of the whitened unknowns z with the prior N(0, I) and the likelihood exp(−D(q(T))):
///
///     z | y ≈ N(z*, B⁻¹),   B = I + JᵀJ,   cov(Az) = A B⁻¹ Aᵀ,
///
/// z* the minimum of the objective and B Gauss–Newton's Hessian there (MatchingObjective::Linearisation): exact where
/// q(T) is linear in z and the data are landmarks. A is ∂p0/∂z, K(q0)∂p0/∂z and ∂q(T)/∂z. In terms of momenta the prior
/// is N(0, (λK)⁻¹) at the landmarks of the basis, and no momentum at all elsewhere; increments of fitted noise are
/// N(0, Δt). The deviations are those of one minimum, and of given kernel, noise, σ and λ.
///
/// Cost: two linearisations, O(UD·min(U, D)) time and O(U(D + dN)) memory for U unknowns and D residuals.
/// @param minimum where ∇J vanishes: MinimiseSummary::solution
LaplaceApproximation laplace(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum);

/// The log of the density of the data y, the unknowns integrated out by Laplace's approximation,
///
///     log p(y) ≈ −J(z*) + ½ gᵀB⁻¹g − ½ log det B − ½ Σ_a log det(2πR_a/w_a),
///
/// with g = ∇J, which vanishes at a minimum but for what the search left; the last sum LandmarkTerm::log_determinant().
/// It is a density in the length units of y to the power of minus the number of coordinates observed. Where there are
/// several realisations, D is a mean over them, and so is the log of the likelihood here.
/// @throws InputError where the data are not landmarks: their term is no log of a normalised density
double log_evidence(const MatchingObjective& objective, const MatchingObjective::Evaluation& minimum);

}  // namespace pulson
