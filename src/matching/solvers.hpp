#pragma once

#include "pulson/matching/minimise.hpp"

namespace pulson {

/// How a search by Gauss–Newton is restricted.
struct Restriction {
  double softness = 1;                   ///< s: the data are held by D/s²
  std::vector<Eigen::Index> unknowns{};  ///< those that are moved; empty: all
  bool cautious = false;                 ///< gives up where the cost falls and the gradient grows, see gauss_newton.cpp
};

/// Levenberg–Marquardt from `start`, see gauss_newton.cpp.
MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start, const Restriction& restriction);

/// NLopt's L-BFGS from `start`, see lbfgs.cpp.
MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start);

}  // namespace pulson
