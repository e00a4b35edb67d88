#pragma once

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// A cost, in nats, that no data would show: what equal shapes have by round-off.
inline constexpr double kNegligibleCost = 1e-12;

/// Levenberg–Marquardt from `start`, see gauss_newton.cpp.
MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start);

/// NLopt's L-BFGS from `start`, see lbfgs.cpp.
MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start);

}  // namespace pulson::matching
