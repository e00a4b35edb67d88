#pragma once

#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// √(Σ_a |x_a − x̄|²) over the landmarks without a missing coordinate, x̄ their mean; length units.
double centroid_size(const Points& points);

/// The generalised Procrustes mean (J. Gower 1975): shapes are aligned with the mean and the mean is recomputed until
/// it converges. It has the orientation of the first shape and, where the alignment scales, the mean centroid size of
/// all shapes. Missing landmarks are left out of the mean. `none` gives the plain mean.
/// @param kind any but `affine` @throws InputError where counts differ, or a landmark is missing in all shapes
Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind);

/// @throws InputError where the two differ in the number of landmarks or in dimension
void require_alike(const Landmarks& first, const Landmarks& other);

}  // namespace pulson
