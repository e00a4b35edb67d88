#pragma once

#include <optional>
#include <vector>

#include "path_search.hpp"

namespace pulson::matching {

/// The minimum near a start of a MatchingProblem of many landmarks, whose data are landmarks and whose noise moves each
/// landmark by itself, or none: without a matrix of the size of the landmarks. Empty where none is found: see
/// path_equations.cpp.
/// @param start fields
std::optional<PathSolution> solve_path_equations(const MatchingProblem& problem, const MinimiseOptions& options,
                                                 const StepFields& start);

/// The same from a path that it found for other data, to Finish::kShootable; not converged where there is none.
PathSolution continue_path_equations(const MatchingProblem& problem, const MinimiseOptions& options, DiscretePath path);

/// The problem without noise that moves each landmark by itself, the data being less firm by what it does, so that its
/// fields are nearly those with the noise.
MatchingProblem without_own_noise(const MatchingProblem& problem);

}  // namespace pulson::matching
