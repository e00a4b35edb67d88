#pragma once

#include "path_search.hpp"

namespace pulson::matching {

/// The best of the minima that several searches over paths end at; see global_search.cpp. Where the data are curves,
/// and on a line without noise, where landmarks keep their order, one search is made.
/// @return its `minima` are all that were found, the first that of the path
PathSolution search_globally(const MatchingProblem& problem, const MinimiseOptions& options,
                             Finish finish = Finish::kRoundOff);

}  // namespace pulson::matching
