#pragma once

#include "pulson/compare/cohort.hpp"

namespace pulson {

/// The end points of one shape, projected onto the directions that its alignment leaves, in units of σ.
struct Observation {
  Eigen::MatrixXd projection;  ///< n×dN: A, so that A(y − q(T)) is the residual
  Eigen::VectorXd target;      ///< A y
  double log_volume = 0;       ///< n log(√(2π) σ)

  Eigen::Index count() const { return projection.rows(); }
  Eigen::VectorXd residual(const Points& q) const { return target - projection * q.reshaped(); }
};

/// @throws InputError where the alignment accounts for all observed coordinates of a target
Observation observe(const Cohort& cohort, int target, double sigma);

}  // namespace pulson
