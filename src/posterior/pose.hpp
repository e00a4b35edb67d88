#pragma once

#include <Eigen/Core>

#include "core/nearest_rotation.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::posterior {

/// What an alignment takes out of data y: the pose. Of positions q it is the motion g of the kind for which
///
///     Σ_a w_a Z_a(y)ᵀ(g q_a − y_a) = 0,
///
/// Z(y) the directions in which motions move y, so that gq − y does not depend on the pose of q; of equal weights that
/// is the best fit. Integrated over the poses with a flat prior (Haar measure) the likelihood is that of gq − y but for
/// Z(y), up to (|gq − y|/|y|)². With Z of the source and q for gq it is so only up to |q − y|/|y|, which in cohorts
/// whose shapes differ by more than their errors is seen. Thread-safe.
class Pose {
 public:
  /// @param source which stands for the coordinates that y lacks in Z(y)
  Pose(const matching::LandmarkTerm& data, const Points& source, AlignmentKind kind);

  /// An orthonormal basis of Z of a shape in the coordinates that are observed, dN×k.
  static Eigen::MatrixXd directions(const matching::LandmarkTerm& data, const Points& shape, AlignmentKind kind);

  /// That of y.
  const Eigen::MatrixXd& directions() const { return directions_; }

  /// gq; what is not finite where q has no such pose.
  Points apply(const Points& q) const;
  /// R ∂(gq)/∂q. @param rows R, n×dN
  Eigen::MatrixXd slopes(const Eigen::MatrixXd& rows, const Points& q) const;

  /// The size of q relative to y: of q turned and shifted onto y, the By that fits it best. The numbers of B: none
  /// where the kind has no size, the multiple of 1 of a similarity, the d² of an affine map.
  Eigen::VectorXd size(const Points& q) const;
  Eigen::Index sizes() const { return size_rows_.rows(); }
  Eigen::MatrixXd size_slopes(const Points& q) const;  ///< ∂B/∂q

 private:
  struct Motion {
    SmallMatrix linear;
    Eigen::VectorXd shift;
  };
  Motion motion(AlignmentKind kind, const Points& q) const;
  Eigen::MatrixXd slopes(AlignmentKind kind, const Eigen::MatrixXd& gauge, const Eigen::MatrixXd& rows,
                         const Points& q) const;

  AlignmentKind kind_;
  Eigen::VectorXd weights_;  // w/Σw, of landmarks that are observed completely
  Eigen::VectorXd mean_;     // ȳ
  Points weighted_;          // w_a (y_a − ȳ)
  SmallMatrix square_;       // Σ_a w_a (y_a − ȳ)(y_a − ȳ)ᵀ
  Eigen::MatrixXd gauge_;    // w_a Z_a(y)
  Eigen::MatrixXd turning_;  // the same of rotations and shifts, where there is a size
  Eigen::MatrixXd size_rows_;
  Eigen::MatrixXd directions_;
};

}  // namespace pulson::posterior
