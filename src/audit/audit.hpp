#pragma once

// What is wrong with landmarks, judged by whether their displacement from other shapes would be more probable without
// it: a start, for one error in a shape.

#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

enum class Problem : unsigned char {
  kExchanged,  ///< two landmarks have each other's names
  kReversed,   ///< the landmarks of an outline run the other way round, perhaps from another one on
  kShifted,    ///< the landmarks of an outline begin at another one
  kMirrored,   ///< the shape is a mirror image
  kUnit,       ///< the coordinates are in another unit of length than those of the other shapes
  kUnordered   ///< positions have nothing in common with those of the same number
};

/// One thing that is probably wrong with one shape.
struct Finding {
  Problem problem = Problem::kExchanged;
  int specimen = 0;              ///< its place in the cohort, from 0
  std::vector<int> landmarks{};  ///< those exchanged, or the one that the first of the others corresponds to; from 0
  double log_odds = 0;           ///< of this against none, natural logarithm; 0 where it is no hypothesis of the model
  double before = 0, after = 0;  ///< root mean square distance after a similarity, length units of the shape
  double factor = 1;             ///< of kUnit: the size over that of most others
};

/// What is wrong with `shape`, the landmarks of which are to correspond with those of `reference` in their order; of
/// several hypotheses the most probable one. None in one dimension, where order changes are no errors, for fewer than 8
/// or more than 300 landmarks in both, or where nothing is found. Costs O(N³).
std::optional<Finding> audit_pair(const Landmarks& reference, const Landmarks& shape);

/// The same of each shape of a cohort against a robust mean of all, and whether its size is in another unit. None for
/// fewer than 5 shapes.
std::vector<Finding> audit_cohort(const std::vector<Landmarks>& shapes);

/// "landmarks 2 and 8 look exchanged (odds 10^9; rms distance 71.1, 14.1 without)"
std::string describe(const Finding& finding, const Landmarks& shape);

}  // namespace pulson::audit
