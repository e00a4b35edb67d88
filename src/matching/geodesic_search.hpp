#pragma once

#include <string>
#include <vector>

#include "path_search.hpp"

namespace pulson::matching {

/// What was found for a problem without noise, and the integrator that shoots its momenta to the end it has.
struct GeodesicSolution {
  Points momenta;  ///< p0, d×N
  std::string integrator;
  TimeGrid grid;                   ///< of the shot
  std::vector<PhaseState> states;  ///< of the path, K + 1, where it is one of `midpoint`
  bool converged = false;
  std::string reason;
  int iterations = 0;
  int evaluations = 0;
  double relative_gradient = 0;
  std::vector<Minimum> minima;              ///< of search_globally()
  std::vector<std::vector<Points>> others;  ///< the same, but none where some landmarks carry the rest
};

/// Minimises λ∫H dt + D(q(T)), D that of landmarks, over geodesics as `rk4` shoots them, or, where that amplifies
/// errors too much, `midpoint`; by searches over paths and defect correction, see geodesic_search.cpp.
/// @param more_steps whether `rk4` may take more steps than the grid of the problem has, see RegistrationOptions
/// @param near nodes of a path of nearly the same shapes, where the search begins, see search_near(); empty: at rest
GeodesicSolution search_geodesic(const MatchingProblem& problem, const MinimiseOptions& options,
                                 bool more_steps = false, const std::vector<Points>& near = {});

}  // namespace pulson::matching
