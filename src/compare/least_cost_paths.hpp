#pragma once

#include <optional>

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {

/// The paths of least cost with the numbers of a fit, where its noise is linear in p or there is none.
std::optional<LeastCostPaths> least_cost_paths(const Cohort& cohort, const CohortFit& fit,
                                               const CohortSettings& settings);

}  // namespace pulson::compare
