#pragma once

#include "discrete_path.hpp"
#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// Of the tolerance, the relative gradient at which a shot of p0 follows the path well: a shot amplifies what is left
/// of it by up to the ratio of the distances to σ.
constexpr double kShootableGradient = 1e-2;

/// Where a search ends.
enum class Finish {
  kShootable,  ///< where a shot of p0 follows the path, within much less than σ
  kNoSaddle,   ///< and there is no negative curvature
  kRoundOff    ///< and the gradient vanishes as far as round-off lets it
};

/// What a search over paths found.
struct PathSolution {
  DiscretePath path;
  StepFields fields;               ///< of the path: where another search may begin
  Points momenta;                  ///< p0, d×N
  Eigen::MatrixXd increments;      ///< u Δt, C×K
  std::vector<PhaseState> states;  ///< K + 1, at the nodes
  MatchingCost cost;
  bool converged = false;
  std::string reason;
  int iterations = 0;
  int evaluations = 0;
  double relative_gradient = 0;
  std::vector<Minimum> minima;  ///< of search_globally()
  /// Nodes, in fewer steps, of the paths of all minima but the first; none of those known for some landmarks alone.
  std::vector<std::vector<Points>> others;
};

/// Fills in what follows from the path of a solution, its grid, nodes, middles and energy: p0, increments, states, cost
/// and fields.
void describe(const EffectiveHamiltonian& system, const DataTerm& data, PathSolution& solution);

/// Minimises λ∫H dt + ½∫Σ u_i² dt + D(q(T)) over paths in midpoint steps and controls u of the noise, whose potentials
/// are linear in p or none: see path_search.cpp. `realisations` of the problem and its integrator play no part.
/// @param start fields to begin with; else landmarks at rest
PathSolution search_paths(const MatchingProblem& problem, const MinimiseOptions& options,
                          const StepFields* start = nullptr, Finish finish = Finish::kRoundOff);

/// Why a search may end with landmarks at rest, where the data cost nothing: shapes that are equal, or a sigma that is
/// large beside their differences.
std::string reason_at_rest(const MatchingProblem& problem);

/// The same from a path, such as one that search_paths() found for a problem that differs in the data alone.
PathSolution continue_path(const MatchingProblem& problem, const MinimiseOptions& options, DiscretePath path,
                           Finish finish = Finish::kShootable);

}  // namespace pulson::matching
