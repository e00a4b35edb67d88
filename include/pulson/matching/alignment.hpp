#pragma once

#include <string>
#include <string_view>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Which global motion is taken out before the flow begins.
enum class AlignmentKind { kNone, kTranslation, kRigid, kSimilarity };

/// x ↦ scale · rotation · x + translation.
struct Alignment {
  AlignmentKind kind = AlignmentKind::kNone;
  double scale = 1;
  Eigen::MatrixXd rotation;     ///< d×d, determinant +1
  Eigen::VectorXd translation;  ///< d

  Points apply(const Points& x) const;
};

/// `none`, `translation`, `rigid`, `similarity`. @throws InputError that lists them
AlignmentKind parse_alignment(std::string_view name);
std::string alignment_name(AlignmentKind kind);

/// The motion of the given kind that brings `source` closest to `target` in the sum of squared distances (Procrustes;
/// Umeyama 1991, reflections excluded). The source is moved, so that the flow and its result live in the target's
/// coordinates. Where either set lies at one place the scale is 1. @param source, target d×N
Alignment align(const Points& source, const Points& target, AlignmentKind kind);

}  // namespace pulson
