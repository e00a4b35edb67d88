#pragma once

#include "pulson/compare/cohort.hpp"
#include "pulson/matching/objective.hpp"

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

/// The posterior of one shape's unknowns z about a point where it was linearised: t = r + Jz, C = I + JJᵀ.
struct Linearised {
  MatchingObjective::Evaluation at;
  Eigen::MatrixXd jacobian;  ///< J, n×U
  Eigen::VectorXd surprise;  ///< t
  double cost = 0;           ///< ½|z|² + ½|r|²
  double gain = 0;           ///< what the cost would still fall by, were q(T) linear
  double log_evidence = 0;
  bool converged = false;
};

/// Whether each unknown is seen, 1 or 0: momenta in a direction by whose prior no landmark moves by more than some
/// three hundredths of σ are not, for no data could tell them, and where landmarks are dense beside the kernel no time
/// step follows them. With Λ the eigenvalue of K in that direction, Λ T²/λ < 1e-3 σ².
Eigen::VectorXd seen_unknowns(const MatchingObjective& objective);

/// About z. @throws InputError where it has no path
Linearised linearised_at(const MatchingObjective& objective, const Observation& observation, const Eigen::VectorXd& z);

/// Searches for the maximum of the posterior from z by Gauss–Newton steps in the space of the data, halved until the
/// cost falls. @throws InputError where even landmarks at rest have no path
Linearised find_match(const MatchingObjective& objective, const Observation& observation, Eigen::VectorXd z);

}  // namespace pulson
