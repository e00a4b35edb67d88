#pragma once

#include <cstdint>

#include "pulson/compare/cohort_fit.hpp"

namespace pulson::compare {

/// Shapes drawn from a model.
struct ForwardSamples {
  Eigen::MatrixXd ends;  ///< observed end points, dN×M, a column each (index a·d + axis)
  int drawn = 0;         ///< M and those whose path could not be followed
};

/// Draws y = q(T) + N(0, σ²) from a model: momenta N(0, (λK(q0))⁻¹), increments N(0, Δt), from the source.
/// Momenta that move no landmark by more than some hundredths of σ are left at 0. Numbers are
/// a function of (seed, sample) only, the same for all models with the same number of unknowns.
ForwardSamples draw_shapes(const matching::MatchingProblem& problem, int count, std::uint64_t seed);

}  // namespace pulson::compare
