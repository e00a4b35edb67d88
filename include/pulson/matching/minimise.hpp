#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "pulson/matching/objective.hpp"

namespace pulson {

/// How the objective is minimised.
enum class Solver {
  kAuto,         ///< Gauss–Newton up to 800 coordinates of q(T), L-BFGS beyond
  kGaussNewton,  ///< Levenberg–Marquardt in data space: few iterations, each O(K (dN)³)
  kLbfgs,        ///< limited-memory quasi-Newton on the adjoint gradient: O(N²) an iteration
};

/// @throws InputError that lists `auto`, `gauss-newton`, `lbfgs`
Solver parse_solver(std::string_view name);
std::string solver_name(Solver solver);

struct MinimiseOptions {
  Solver solver = Solver::kAuto;
  int max_iterations = 500;
  /// Converged where the relative gradient is at most this. Gauss–Newton: √(gᵀB⁻¹g / 2J) with g = ∇J and B = I + JᵀJ,
  /// the norm of g in the metric of the problem itself; its square is the part of J that is still to be gained. L-BFGS,
  /// which has no B: relative_gradient().
  double gradient_tolerance = 1e-5;
  /// Called after each iteration, for progress.
  std::function<void(int iteration, double cost, double relative_gradient)> on_iteration{};
};

struct MinimiseSummary {
  Solver solver = Solver::kAuto;  ///< the one that was used
  bool converged = false;
  std::string reason{};  ///< why it stopped, in words
  int iterations = 0;
  int evaluations = 0;
  double relative_gradient = 0;
  MatchingObjective::Evaluation solution{};
};

/// Minimises the objective, from the flow of the problem without noise and, where there is noise, also from landmarks
/// that noise alone moves straight to their targets; the lower minimum is returned.
MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options);

/// |∇J| / (|z| + |∇J − z|), 0 where both vanish.
double relative_gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient);

}  // namespace pulson
