#pragma once

#include "path_search.hpp"

namespace pulson::matching {

/// The mean of λΣ_i h_i,p² over coordinates at the source, what the noise adds to K(0).
double added_by_noise(const MatchingProblem& problem);

/// The problem with noise on every landmark besides, λβ² = `more`; itself where that is not above 0.
MatchingProblem with_more_noise(MatchingProblem problem, double more);

/// For landmarks on a line that each have noise, moves_each_along_line(): over paths that keep velocities, from rest
/// with as much noise on each as the kernel has at 0, where there is one minimum, and on to less and less, down to the
/// problem's own.
PathSolution search_from_much_noise(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish);

}  // namespace pulson::matching
