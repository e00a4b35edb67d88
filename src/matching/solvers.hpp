#pragma once

#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// A cost, in nats, that no data would show: what equal shapes have by round-off.
inline constexpr double kNegligibleCost = 1e-12;

/// Unknowns of the paths of least cost that searches find, the best first, with the action of the noise where its
/// potentials are linear in p: where minimise() begins.
/// @param within nats: of other minima than the first only those that cost no more above it than this
/// @param counts to which iterations and evaluations are added
std::vector<Eigen::VectorXd> path_guesses(const MatchingObjective& objective, const MinimiseOptions& options,
                                          double within, MinimiseSummary& counts);

/// minimise(), from these unknowns or from rest, whichever costs less.
MinimiseSummary minimise_from(const MatchingObjective& objective, const MinimiseOptions& options,
                              const Eigen::VectorXd& z);

/// Levenberg–Marquardt from `start`, see gauss_newton.cpp.
MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start);

/// NLopt's L-BFGS from `start`, see lbfgs.cpp.
MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start);

}  // namespace pulson::matching
