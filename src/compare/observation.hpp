#pragma once

#include "pulson/compare/cohort.hpp"

namespace pulson {

/// What is seen of the end points of one shape: in the directions that the alignment leaves, in units of σ.
struct Observation {
  Eigen::MatrixXd seen;    ///< n×dN: A, so that A(y − q(T)) is the residual
  Eigen::VectorXd target;  ///< A y
  double log_volume = 0;   ///< n log(√(2π) σ)

  Eigen::Index count() const { return seen.rows(); }
  Eigen::VectorXd residual(const Points& q) const { return target - seen * q.reshaped(); }
};

/// @throws InputError where nothing is left to be seen of a target
Observation observe(const Cohort& cohort, int target, double sigma);

}  // namespace pulson
