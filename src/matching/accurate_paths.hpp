#pragma once

#include "path_search.hpp"

namespace pulson::matching {

/// A cost that twice as many steps would change by no more than this part is accurate; else they are taken, up to so
/// many times those that the problem has.
constexpr double kAccurate = 3e-3;
constexpr int kMostSteps = 8;

/// search_paths(), or without a start search_globally(), and on from what it finds in twice as many steps until the
/// cost is accurate.
PathSolution search_accurate_paths(const MatchingProblem& problem, const MinimiseOptions& options,
                                   const StepFields* start = nullptr);

/// The same from what a search found.
PathSolution in_enough_steps(const MatchingProblem& problem, const MinimiseOptions& options, PathSolution found);

}  // namespace pulson::matching
