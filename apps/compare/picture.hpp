#pragma once

#include "charts/chart.hpp"
#include "pulson/compare/comparison.hpp"

namespace pulson {

/// The ranking, and why: scores; displacements along the kernel's eigenvectors, observed and predicted; predictions;
/// and what the noise moved each landmark.
charts::Chart comparison_chart(const compare::Comparison& comparison);

/// The scores over sigma. @param comparison with a profile
charts::Chart sigma_chart(const compare::Comparison& comparison);

/// How often each model is chosen, by the model that was drawn from.
charts::Chart recovery_chart(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                             const compare::RecoveryOptions& options);

}  // namespace pulson
