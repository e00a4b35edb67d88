#pragma once

#include <cstdint>

#include "posterior.hpp"

namespace pulson {

/// The evidence of one shape by importance sampling.
struct ImportanceEstimate {
  double log_evidence = 0;
  double variance = 0;           ///< of that logarithm
  double effective_samples = 0;  ///< (Σw)²/Σw²
};

/// Draws z = z* + δ from Laplace's approximation N(z*, B⁻¹), B = I + JᵀJ, and weighs what the linear model left out:
///
///     log p(y) = Laplace's + log E[w],   w = exp(½|t − Jz|² − ½|r(z)|²)
///
/// δ = ζ − Jᵀ C⁻¹ (Jζ + ε) with ζ, ε ~ N(0, I), so that no U×U matrix is made.
ImportanceEstimate importance_sample(const MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, std::uint64_t seed);

}  // namespace pulson
