#pragma once

#include <string>

#include "pulson/compare/comparison.hpp"

namespace pulson {

/// What scripts read: `comparison.json`.
std::string comparison_json(const Comparison& comparison, double seconds);

/// The centroid size of each shape as it was given, over the landmarks that are not missing, length units.
std::string specimens_csv(const CohortShapes& shapes);

/// Each shape under each model, a line each.
std::string shapes_csv(const Comparison& comparison);

/// `recovery.json`
std::string recovery_json(const std::vector<RecoveryRow>& rows, const std::vector<std::string>& candidates,
                          const RecoveryOptions& options, double seconds);

/// @throws InputError where it cannot be
std::string mode_of(const CohortFit& fit);

}  // namespace pulson
