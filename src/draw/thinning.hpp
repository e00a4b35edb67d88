#pragma once

#include <cstddef>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// At most `most` (≥ 2) of the indices 0, …, count − 1, evenly spaced, including both ends.
std::vector<std::size_t> spread_indices(std::size_t count, std::size_t most);

/// For each of these landmarks, the times that have to be drawn to show its whole path.
///
/// The time from first to last is cut into equal pieces. Of each piece those entries are kept where a coordinate is
/// least and where it is greatest, so that the drawn line fills the same range in every piece: noise keeps its
/// width, and no spike is lost. The first entry and the last are kept as well.
///
/// trajectory: K+1 entries d×N, finite; landmarks: columns of them; times: K+1, increasing. Returns for each landmark
/// increasing indices into `times`, no more than max(most, 2d + 2); all of them where K+1 ≤ most. One pass.
std::vector<std::vector<std::size_t>> thin_paths(const std::vector<Points>& trajectory,
                                                 const std::vector<int>& landmarks, const std::vector<double>& times,
                                                 std::size_t most);

/// Drops vertices of lines 2×M until `most` are left in all, those first without which the lines change least.
///
/// A vertex counts by its distance from the chord that replaces it where the line is divided at the farthest vertex,
/// again and again (D. Douglas and T. Peucker, 1973), so a spike stays when the straight parts around it are long gone.
/// The ends of lines are always kept; nothing is dropped if there are at most `most` vertices.
void simplify_lines(std::vector<Points>& lines, std::size_t most);

}  // namespace pulson
