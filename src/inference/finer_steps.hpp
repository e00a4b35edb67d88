#pragma once

#include "reference_weight.hpp"

namespace pulson::inference {

/// log p(y | φ̂) of twice as many steps less that of the steps of the specimens, with the integrator they have: of a
/// path of weighted draws the Brownian path is the same, refined by a normal number for each step and channel, so that
/// what the draws have in common cancels. Its error is small where the steps are; NaN where fewer than 30 draws are
/// effective.
/// @param finer the same specimens with twice as many steps @param most draws of each; fewer where it is known to a
/// quarter of kStepError
Estimate evidence_of_finer_steps(const ChainSetting& setting, const std::vector<Specimen>& finer, std::int64_t most);

/// The same problem with twice as many steps.
PosteriorProblem with_finer_steps(PosteriorProblem problem);

/// The specimens of a problem.
std::vector<Specimen> specimens_of(const PosteriorProblem& problem);

}  // namespace pulson::inference
