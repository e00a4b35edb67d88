#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// `shape` turned, moved and scaled onto `target` by most landmarks, whatever the others are. The scale is a median
/// over pairs of landmarks, so that nothing far away shrinks the shape; landmarks whose distances from the others fit
/// begin, and weigh less the further away they come to lie than the median (weights of S. Geman and D. McClure, 1985).
/// @param shape, target d×N; landmarks with a missing coordinate in either are moved along @return d×N
Points robustly_aligned(const Points& shape, const Points& target);

/// Root mean square distance of the landmarks that both have after a similarity, length units of `shape`.
double rms_apart(const Points& reference, const Points& shape);

double median_of(std::vector<double> values);

/// The landmarks that are complete in both.
std::vector<int> observed_in_both(const Points& a, const Points& b);

}  // namespace pulson::audit
