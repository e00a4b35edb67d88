#pragma once

#include "pulson/matching/minimise.hpp"

namespace pulson {

/// Levenberg–Marquardt from `start`, see gauss_newton.cpp.
MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start);

/// NLopt's L-BFGS from `start`, see lbfgs.cpp.
MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start);

}  // namespace pulson
