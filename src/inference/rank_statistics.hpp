#pragma once

#include <vector>

namespace pulson::inference {

/// How many ranks are at most 0, 1, …, `largest`.
std::vector<int> rank_counts(const std::vector<int>& ranks, int largest);

/// The probability, for uniform ranks, of counts of which one is as far out, by its own binomial law, as the farthest
/// of these.
double rank_p_value(const std::vector<int>& counts);

}  // namespace pulson::inference
