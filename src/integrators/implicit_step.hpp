#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// How the root of an implicit step was found.
struct ImplicitRoot {
  Points q;
  bool found = false;
  bool continued = false;  ///< found by continuation in the step size
  double contraction = 0;  ///< largest ratio of successive corrections of the fixed-point iteration
};

/// Solves q = c + Δt K(q)p for q, to round-off.
///
/// The fixed-point iteration from q = c is used while each correction is at most 0.9 of the one before, and its limit
/// is taken if no two landmarks have turned about each other by more than a right angle. Where it is not, Newton
/// follows the root from Δt = 0, q = c in steps s of sΔt; a step is accepted if Newton's correction is small beside the
/// predicted move the determinant of I − sΔtA keeps its sign and no two landmarks turn
/// about each other by more than a right angle. Where that fails the branch ends (or its end cannot
/// be told from it) and `found` is false.
ImplicitRoot solve_positions(const KernelOperator& kernel, const Points& c, const Points& p, double dt,
                             RootSearch search);

/// Solves (I − ΔtA)x = b, or its transpose, A = tangent_matrix(q, p): by the same iteration while it contracts, else by
/// LU factors.
Points solve_tangent(const KernelOperator& kernel, const Points& q, const Points& p, double dt, const Points& b);
Points solve_tangent_transposed(const KernelOperator& kernel, const Points& q, const Points& p, double dt,
                                const Points& b);

}  // namespace pulson
