#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Which global transformation is removed before the flow begins.
enum class AlignmentKind { kNone, kTranslation, kRigid, kSimilarity, kAffine };

/// x ↦ scale · linear · x + translation.
struct Alignment {
  AlignmentKind kind = AlignmentKind::kNone;
  double scale = 1;
  Eigen::MatrixXd linear;       ///< d×d: orthogonal; for an affine map any regular matrix, and then scale = 1
  Eigen::VectorXd translation;  ///< d

  Points apply(const Points& x) const;
};

/// `none`, `translation`, `rigid`, `similarity`, `affine`. @throws InputError that lists them
AlignmentKind parse_alignment(std::string_view name);
std::string alignment_name(AlignmentKind kind);

struct AlignmentOptions {
  Eigen::VectorXd weights;  ///< w, N numbers, 0 or greater; empty: all 1
  bool reflect = false;     ///< allow a negative determinant, where that fits better
};

/// The map of the given kind that brings `source` closest to `target`: it minimises
///
///     Σ_a w_a |scale · linear · x_a + translation − y_a|²
///
/// (Procrustes; Umeyama 1991, with weights). The source is moved, so that the flow and its result live in the target's
/// coordinates. Landmarks of weight 0, or with a coordinate that is not finite in either shape, are left out. Where
/// either shape lies at one place, a rigid map or a similarity is a translation.
/// @param source, target d×N
/// @throws InputError where no landmark is left, the weights are wrong, or there is no regular affine map: fewer than
/// d + 1 landmarks in general position, or a negative determinant without `reflect`
Alignment align(const Points& source, const Points& target, AlignmentKind kind, const AlignmentOptions& options = {});

/// An orthonormal basis of the displacements, dN×r, by which motions of the given kind change a shape to first order:
/// what an alignment leaves out of data. @param observed the places (index a·d + axis) of the coordinates that count,
/// n of them: the basis is then n×r
Eigen::MatrixXd motion_directions(const Points& shape, AlignmentKind kind, const std::vector<Eigen::Index>& observed);

/// √(Σ_a |x_a − x̄|²) over the landmarks without a missing coordinate, x̄ their mean; length units.
double centroid_size(const Points& points);

/// The generalised Procrustes mean (J. Gower 1975): shapes are aligned with the mean and the mean is recomputed until
/// it converges. It has the orientation of the first shape and, where the alignment scales, the mean centroid size of
/// all shapes. Missing landmarks are left out of the mean. `none` gives the plain mean.
/// @param kind any but `affine` @throws InputError where counts differ, a landmark misses in all, or a shape has too
/// few
Landmarks procrustes_mean(const std::vector<Landmarks>& shapes, AlignmentKind kind);

/// @throws InputError where the two differ in the number of landmarks or in dimension
void require_alike(const Landmarks& first, const Landmarks& other);

}  // namespace pulson
