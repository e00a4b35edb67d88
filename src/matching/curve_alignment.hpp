#pragma once

#include "pulson/core/alignment.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {

struct CurveAlignmentOptions {
  CurveMeasure measure = CurveMeasure::kVarifold;
  double width = 0;      ///< of the data, length units; the alignment's is a quarter of the target's diameter, or this
  bool reflect = false;  ///< allow a negative determinant, where that fits better
};

/// The map of the given kind that brings a curve closest to another, without correspondence of their points: the least
/// of the CurveTerm
///
///     D(sRx + t)   over rotations R, t and, for a similarity, log s,
///
/// by L-BFGS on the manifold of rotations, with a width of a half, then a quarter of the target's diameter: the flow is
/// to match what is finer. D has a minimum for each pose in which the curves are roughly alike, so that searches start
/// from no turn, from those that bring principal axes together, and from others all around; the least is taken, and of
/// those that cost the same to a thousandth the first. A translation brings the middles of the curves together.
/// @throws InputError for an affine map, which needs correspondence
Alignment align_curves(const Curve& source, const Curve& target, AlignmentKind kind,
                       const CurveAlignmentOptions& options);

}  // namespace pulson::matching
