#pragma once

#include <vector>

#include <Eigen/Core>

#include "pulson/core/alignment.hpp"

namespace pulson::cohort {

/// Places (index a·d + axis) of the coordinates of the landmarks that are complete, or of the others.
std::vector<Eigen::Index> places_of(const Points& points, bool observed);

/// x ↦ second(first(x))
Alignment composed(const Alignment& second, const Alignment& first);
/// Of a similarity, a rigid map, a translation.
Alignment inverted(const Alignment& similarity);

/// Shapes in any pose, y = pose(mean + x), x normal with covariance Σ, the poses with a flat prior: to first order in
/// the pose y = mean + Za + x with Z of motion_directions() and any a, universal kriging. The pose moves the mean, not
/// the shape: the scale that brings a shape nearest to the mean is smaller by the cosine of their distance, so that
/// means of shapes that are aligned so again and again shrink to a point.
class PosedShapes {
 public:
  /// @param covariance dN×dN; its part along Z does not count @param noise σ², the variance in it of the noise of a
  /// coordinate, where landmarks have precisions
  PosedShapes(Points mean, AlignmentKind alignment, const Eigen::MatrixXd& covariance, double noise = 0);

  /// What the observed coordinates of a shape show of its pose and of the missing ones.
  struct Conditional {
    std::vector<Eigen::Index> observed, missing;  ///< places of O and M coordinates
    Eigen::VectorXd pose;                         ///< a
    Eigen::VectorXd displacement;                 ///< of the missing from the mean, expected
    Eigen::MatrixXd covariance;                   ///< of these, M×M
    Eigen::MatrixXd weights;                      ///< M×O, of the observed displacements in the expected ones
    Eigen::MatrixXd information;  ///< O×O, on the mean of the observed: V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹
    double distance = 0;          ///< squared, of the observed displacements in this metric
  };

  /// @param placed d×N, near the mean's pose; missing landmarks are NaN @param precisions v, N: the noise of landmark a
  /// has the variance σ²/v_a, and with v_a = 0 it is missing; empty: all 1
  Conditional condition(const Points& placed, const Eigen::VectorXd& precisions = {}) const;

  /// The map of a shape onto the mean after which the pose a of condition() is 0. @param shape d×N, in any coordinates
  Alignment placing(const Points& shape, const Eigen::VectorXd& precisions = {}) const;

  const Points& mean() const { return mean_; }
  const Eigen::MatrixXd& directions() const { return directions_; }  ///< Z, dN×r
  const Eigen::MatrixXd& basis() const { return basis_; }            ///< orthonormal, of what is orthogonal to Z
  const Eigen::MatrixXd& covariance() const { return covariance_; }  ///< Σ without what it has along Z
  double noise() const { return noise_; }                            ///< σ²

 private:
  Eigen::MatrixXd covariance_of(const Eigen::VectorXd& precisions, const std::vector<Eigen::Index>& observed) const;

  Points mean_;
  AlignmentKind alignment_;
  Eigen::MatrixXd directions_, basis_, covariance_;
  double noise_;
};

/// The expected shapes of a cohort given what each shows (E of EM).
struct ExpectedShapes {
  std::vector<Alignment> placings;  ///< of the shapes as given
  std::vector<Points> placed;       ///< as given, posed
  std::vector<Points> complete;     ///< with the expected positions of missing landmarks
  Eigen::MatrixXd uncertain;        ///< dN×dN, the sum of the covariances of missing coordinates
};

/// @param shapes d×N, in any coordinates; missing landmarks are NaN
ExpectedShapes expected_shapes(const PosedShapes& law, const std::vector<Points>& shapes);

/// The mean of greatest expected likelihood (M of EM), in the pose and of the size of the mean of the law.
Points updated_mean(const PosedShapes& law, const std::vector<Points>& complete, AlignmentKind alignment);

}  // namespace pulson::cohort
