#pragma once

#include "observation.hpp"
#include "pulson/matching/objective.hpp"

namespace pulson {

/// The posterior of one shape's unknowns z about a point where it was linearised: t = r + Jz, C = I + JJᵀ.
struct Linearised {
  MatchingObjective::Evaluation at;
  Eigen::MatrixXd jacobian;    ///< J, n×U
  Eigen::VectorXd innovation;  ///< t
  double cost = 0;             ///< ½|z|² + ½|r|²
  double gain = 0;             ///< what the cost would still fall by, were q(T) linear
  double log_evidence = 0;
  bool converged = false;
};

/// Whether each unknown is observable, 1 or 0: momenta are not in a direction whose prior moves no landmark by more
/// than about 0.03 σ, because no data could determine them and, where landmarks are dense relative to the kernel, no
/// time step resolves them. With Λ the eigenvalue of K in that direction, Λ T²/λ < 1e-3 σ².
Eigen::VectorXd observable_unknowns(const MatchingObjective& objective);

/// About z. @throws InputError where it has no path
Linearised linearised_at(const MatchingObjective& objective, const Observation& observation, const Eigen::VectorXd& z);

/// Searches for the maximum of the posterior from z by Gauss–Newton steps in the space of the data, halved until the
/// cost falls. @throws InputError where even landmarks at rest have no path
Linearised find_match(const MatchingObjective& objective, const Observation& observation, Eigen::VectorXd z);

}  // namespace pulson
