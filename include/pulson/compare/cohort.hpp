#pragma once

#include <vector>

#include "pulson/matching/alignment.hpp"

namespace pulson {

/// One shape and those that it is to become, all in its coordinates.
struct Cohort {
  Landmarks source;
  std::vector<Landmarks> targets;
  AlignmentKind alignment = AlignmentKind::kNone;  ///< of each target onto the source
};

/// Moves every target onto the source by a motion of the given kind (see align()); a landmark that has a missing
/// coordinate plays no part in that. @throws InputError where there is no target, numbers of landmarks or dimensions
/// differ, or the source has a missing coordinate
Cohort make_cohort(const Landmarks& source, const std::vector<Landmarks>& targets, AlignmentKind alignment);

/// The mean of shapes that are moved onto it, and it onto their mean, in turn, until it rests (generalised Procrustes
/// analysis: J. Gower 1975). It lies as the first shape does and has, where motions scale, the mean centroid size of
/// all. Landmarks that a shape misses are left out of the mean. `none` gives the plain mean.
/// @param kind any but `affine` @throws InputError where counts differ, or a landmark is missing in all shapes
Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind);

}  // namespace pulson
