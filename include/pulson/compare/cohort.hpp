#pragma once

#include <vector>

#include "pulson/core/alignment.hpp"

namespace pulson {

/// A source shape and its targets, all in the coordinates of the source.
struct Cohort {
  Landmarks source;
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;  ///< of each target onto the source
};

/// Aligns every target with the source by a transformation of the given kind (see align()); landmarks with a missing
/// coordinate are ignored. @throws InputError where there is no target, numbers of landmarks or dimensions
/// differ, or the source has a missing coordinate
Cohort make_cohort(const Landmarks& source, const std::vector<Landmarks>& targets, AlignmentKind alignment);

/// The generalised Procrustes mean (J. Gower 1975): shapes are aligned with the mean and the mean is recomputed until
/// it converges. It has the orientation of the first shape and, where the alignment scales, the mean centroid size of
/// all shapes. Missing landmarks are left out of the mean. `none` gives the plain mean.
/// @param kind any but `affine` @throws InputError where counts differ, or a landmark is missing in all shapes
Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind);

}  // namespace pulson
