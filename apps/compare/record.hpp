#pragma once

#include <string>

#include "pulson/compare/comparison.hpp"

namespace pulson {

/// What scripts read: `comparison.json`.
std::string comparison_json(const compare::Comparison& comparison, double seconds);

/// The centroid size of each shape as it was given, over the landmarks that are not missing, length units.
std::string specimens_csv(const compare::CohortShapes& shapes);

/// Each shape under each model, a line each.
std::string shapes_csv(const compare::Comparison& comparison);

/// Each model, a line each: evidence, score, fitted numbers with their intervals, means of the matches, prediction.
std::string models_csv(const compare::Comparison& comparison);

/// The variance of the displacements along each eigenvector of the kernel, observed and by each model, a line each.
/// Statistics of the shapes beside those of cohorts drawn from the models.
std::string checks_csv(const compare::Comparison& comparison);
/// The score of each model over sigma. @param comparison with a profile
std::string sigma_csv(const compare::Comparison& comparison);
std::string spectrum_csv(const compare::Comparison& comparison);

/// The displacement of each landmark by the noise of each model, root mean square over the shapes, a line each.
std::string landmarks_csv(const compare::Comparison& comparison);

/// `recovery.json`
std::string recovery_json(const std::vector<compare::RecoveryRow>& rows, const std::vector<std::string>& candidates,
                          const compare::RecoveryOptions& options, double seconds);

/// @throws InputError where it cannot be
std::string mode_of(const compare::CohortFit& fit);

}  // namespace pulson
