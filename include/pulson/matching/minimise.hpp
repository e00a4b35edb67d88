#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/matching/objective.hpp"

namespace pulson {

/// How the objective is minimised.
enum class Solver {
  kAuto,         ///< paths where the problem is one of paths in midpoint steps, else shooting by its size
  kPaths,        ///< Newton's method on paths, see search_paths()
  kGaussNewton,  ///< shooting, Levenberg–Marquardt with dense Jacobians: few iterations
  kLbfgs,        ///< shooting, limited-memory quasi-Newton on the adjoint gradient: O(N²) an iteration, O(NK) memory
};

/// @throws InputError that lists `auto`, `paths`, `gauss-newton`, `lbfgs`
Solver parse_solver(std::string_view name);
std::string solver_name(Solver solver);

struct MinimiseOptions {
  Solver solver = Solver::kAuto;
  int max_iterations = 500;
  /// Converged where the relative gradient is at most this: √(gᵀB⁻¹g / 2J) with g = ∇J and B Gauss–Newton's model of
  /// the second derivatives; its square is the part of J that is still to be gained. L-BFGS, which has no B:
  /// relative_gradient().
  double gradient_tolerance = 1e-3;
  std::uint64_t seed = 1;  ///< of the disturbance of a start
  /// Called after each iteration, for progress.
  std::function<void(int iteration, double cost, double relative_gradient)> on_iteration{};
};

struct MinimiseSummary {
  Solver solver = Solver::kAuto;  ///< the one that was used
  bool converged = false;
  std::string reason{};  ///< why it stopped, in words
  int iterations = 0;    ///< of the search over paths and of shooting
  int evaluations = 0;
  double relative_gradient = 0;
  MatchingObjective::Evaluation solution{};
};

/// Minimises the objective by shooting, from what a search over paths finds: with the noise as a control where it is to
/// be fitted and linear in p, else without noise.
MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options);

/// |∇J| / (|z| + |∇J − z|), 0 where both vanish.
double relative_gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient);

}  // namespace pulson
