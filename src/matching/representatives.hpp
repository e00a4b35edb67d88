#pragma once

#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// Where there are many landmarks a search begins with so many of them.
inline constexpr Eigen::Index kFewLandmarks = 150;

/// `count` of the landmarks that are observed, distributed over the shape: each the furthest from those before it
/// (Gonzalez 1985). O(N count). In their order.
std::vector<Eigen::Index> representatives(const MatchingProblem& problem, Eigen::Index count);

/// Whether the problem of a part of its landmarks is of the same kind: data are landmarks, and noise, if any, acts on
/// each landmark alike.
bool can_be_subsampled(const MatchingProblem& problem);

}  // namespace pulson::matching
