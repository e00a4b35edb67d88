#pragma once

#include <cstdint>
#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// K + 1 nodes of landmarks that go straight to their targets at even speed; what was not observed stays.
std::vector<Points> straight_path(const MatchingProblem& problem);

/// The same, bent half way: each landmark by a part of its displacement, at a right angle to it; on a line ahead or
/// back. First all landmarks to the one side and to the other (in space in each of two planes), then each to a side
/// drawn at random, strongly and less strongly in turn.
/// @param index 0, 1, … of the bend
std::vector<Points> bent_path(const MatchingProblem& problem, int index, std::uint64_t seed);

}  // namespace pulson::matching
