#pragma once

#include "discrete_path.hpp"
#include "pulson/matching/minimise.hpp"

namespace pulson {

/// What a search over paths found.
struct PathSolution {
  DiscretePath path;
  StepFields fields;           ///< of the path: where another search may begin
  Points momenta;              ///< p0, d×N
  Eigen::MatrixXd increments;  ///< u Δt, C×K
  MatchingCost cost;
  bool converged = false;
  std::string reason;
  int iterations = 0;
  int evaluations = 0;
  double relative_gradient = 0;
};

/// Minimises λ∫H dt + ½∫Σ u_i² dt + D(q(T)) over paths in midpoint steps and controls u of the noise, whose potentials
/// are linear in p or none: see path_search.cpp. `realisations` of the problem and its integrator play no part.
/// @param start fields to begin with; else landmarks at rest
/// @param near_minimum `start` is from the minimum of nearly the same problem: this one's is not tested for a saddle
PathSolution search_paths(const MatchingProblem& problem, const MinimiseOptions& options,
                          const StepFields* start = nullptr, bool near_minimum = false);

}  // namespace pulson
