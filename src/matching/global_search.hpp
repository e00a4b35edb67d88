#pragma once

#include <optional>
#include <vector>

#include "path_search.hpp"

namespace pulson::matching {

/// The best of the minima that several searches over paths end at; see global_search.cpp. Where the data are curves,
/// and on a line without noise, where landmarks keep their order, one search is made.
/// @return its `minima` are all that were found, the first that of the path, and `others` the paths of the rest
PathSolution search_globally(const MatchingProblem& problem, const MinimiseOptions& options,
                             Finish finish = Finish::kRoundOff);

/// The minimum that a search ends at which begins at the path through these nodes, resampled to the steps of the
/// problem; empty where there is no path through them.
std::optional<PathSolution> search_along(const MatchingProblem& problem, const MinimiseOptions& options,
                                         const std::vector<Points>& nodes, Finish finish = Finish::kRoundOff);

/// The minimum that a search ends at which begins in the fields of the path through these nodes, of nearly the same
/// shapes: of this source landmarks are carried by them. Its `minima` are that one alone. Where there is no path
/// through the nodes, as search_globally().
PathSolution search_near(const MatchingProblem& problem, const MinimiseOptions& options,
                         const std::vector<Points>& nodes, Finish finish = Finish::kRoundOff);

/// Whether some landmarks come much closer to each other on a path than they are at both of its ends. Where none do,
/// the minimum is hardly ever one of several: see global_search.cpp.
bool landmarks_meet(const std::vector<Points>& nodes);

}  // namespace pulson::matching
