#pragma once

#include <limits>
#include <vector>

#include "pulson/compare/cohort_fit.hpp"
#include "pulson/matching/objective.hpp"

namespace pulson::compare {

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

/// The posterior of one shape's unknowns z about a point where it was linearised: t = r + Jz, C = I + JJᵀ.
struct Linearised {
  matching::MatchingObjective::Evaluation at;  ///< without a path where vector code has shot it
  Points end;                                  ///< q(T)
  Eigen::MatrixXd jacobian;                    ///< J, n×U
  Eigen::VectorXd innovation;                  ///< t
  double cost = 0;                             ///< ½|z|² + ½|r|²
  double gain = 0;                             ///< what the cost would still fall by, were q(T) linear
  double log_evidence = 0;
  bool converged = false;
};

/// MatchingProblem::faint of all that is fitted to a cohort: no data could determine momenta that move landmarks by
/// less than about 0.03 σ, and, where landmarks are dense relative to the kernel, no time step resolves them.
inline constexpr double kFaint = 1e-3;

/// About z. @throws InputError where it has no path
Linearised linearised_at(const matching::MatchingObjective& objective, const Observation& observation,
                         const Eigen::VectorXd& z);

/// Searches for the maximum of the posterior from the start of least cost, or from rest where none has a path, by
/// Gauss–Newton steps in the space of the data, continued by secants where the cost falls so, and else halved until it
/// does.
/// @param good starts are not compared with others where their cost is less
/// @throws NumericalError where even landmarks at rest have no path
Linearised find_match(const matching::MatchingObjective& objective, const Observation& observation,
                      const std::vector<Eigen::VectorXd>& starts,
                      double good = -std::numeric_limits<double>::infinity());

class LaneShots;

/// find_match() of several shapes at once in vector lanes, as many as there are.
/// @param observations of each shape @param starts of each @param good of each
std::vector<Linearised> find_matches(const LaneShots& shots, const matching::MatchingObjective& objective,
                                     const std::vector<const Observation*>& observations,
                                     const std::vector<std::vector<Eigen::VectorXd>>& starts,
                                     const std::vector<double>& good);

}  // namespace pulson::compare
