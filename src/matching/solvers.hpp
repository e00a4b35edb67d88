#pragma once

#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson::matching {

/// A cost, in nats, that no data would show: what equal shapes have by round-off.
inline constexpr double kNegligibleCost = 1e-12;

/// Why a search ended at a wall of paths whose steps do not contract.
inline constexpr const char* kTooCoarse = "the time step is too coarse: use more steps";

/// Unknowns of the paths of least cost that searches find, the best first, with the action of the noise where its
/// potentials are linear in p: where minimise() begins.
/// @param within nats: of other minima than the first only those that cost no more above it than this
/// @param counts to which iterations and evaluations are added
std::vector<Eigen::VectorXd> path_guesses(const MatchingObjective& objective, const MinimiseOptions& options,
                                          double within, MinimiseSummary& counts);

/// minimise(), from these unknowns or from rest, whichever costs less.
MinimiseSummary minimise_from(const MatchingObjective& objective, const MinimiseOptions& options,
                              const Eigen::VectorXd& z);

/// The same from there alone: by Levenberg–Marquardt or L-BFGS.
MinimiseSummary minimise_at(const MatchingObjective& objective, const MinimiseOptions& options,
                            MatchingObjective::Evaluation start);

/// Whether the noise of a problem is a control that is paid for along the path: MatchingProblem::along_path.
bool pays_for_controls(const MatchingProblem& problem);

/// Levenberg–Marquardt from `start`, see gauss_newton.cpp.
MinimiseSummary minimise_gauss_newton(const MatchingObjective& objective, const MinimiseOptions& options,
                                      MatchingObjective::Evaluation start);

/// Ceres' L-BFGS from `start`, see lbfgs.cpp.
MinimiseSummary minimise_lbfgs(const MatchingObjective& objective, const MinimiseOptions& options,
                               MatchingObjective::Evaluation start);

}  // namespace pulson::matching
