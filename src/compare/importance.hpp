#pragma once

#include <cstdint>
#include <vector>

#include "posterior.hpp"

namespace pulson::compare {

/// Fraction of effective samples below which their evidence is uncertain.
inline constexpr double kFewEffective = 0.1;

/// The evidence of one shape by importance sampling.
struct ImportanceEstimate {
  double log_evidence = 0;  ///< of the mean weight, and half of its variance, which the logarithm takes off
  double variance = 0;      ///< of that logarithm
  int samples = 0;
  double effective_samples = 0;  ///< (Σw)²/Σw²
  int lost = 0;                  ///< draws without a path, of weight 0
  Eigen::VectorXd log_sets;      ///< log of the mean weight of each set of draws that differ in signs alone
};

/// Randomise then optimise (Bardsley, Solonen, Haario & Laine 2014): with r(z) the residual and J its derivative at the
/// match, draws
///
///     z = ζ + Jᵀv,   v = ε + r(z),   ζ, ε ~ N(0, I),
///
/// so that each fits perturbed data as well as the match fits those observed, however much q(T) bends between them.
/// Where q(T) is linear that is the posterior. In general z has the density
///
///     N(η; 0, I + JᵀJ) |det(I + J(z)Jᵀ)|,   η = z − Jᵀr(z),
///
/// with which it is weighed. Draws come in sets that differ in signs alone: ±(ζ, ε), which takes the odd terms out of
/// the sum, and the same with the other sign of the noise. The latter makes the sum even in the amplitudes, as the
/// evidence is: otherwise it has a slope at β = 0 that is an error of the draws, and a maximum beside it.
///
/// The draws move continuously with the numbers of the model: ζ is white noise at the landmarks, and so at the pivots
/// of their basis, whatever its eigenvectors.
/// @param samples at most, rounded up to whole sets, and half of that without noise @param enough the variance of the
/// logarithm at which fewer will do
/// @param begin where the iteration of each draw begins, and where it ended then; empty at first
ImportanceEstimate importance_sample(const matching::MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, double enough, std::uint64_t seed,
                                     std::vector<Eigen::VectorXd>& begin);

/// The part of the evidence where no draw of importance_sample() comes, as its iteration ends elsewhere, in units of
/// Laplace's evidence, and the variance of that: from draws of which half are from the prior and half from Laplace's
/// approximation, twice as wide, each weighed by the mean of both densities.
struct BeyondEstimate {
  double part = 0, variance = 0;
};
BeyondEstimate sample_beyond(const matching::MatchingObjective& objective, const Observation& observation,
                             const Linearised& match, int samples, std::uint64_t seed);

}  // namespace pulson::compare
