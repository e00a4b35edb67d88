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
  kAuto,  ///< Gauss–Newton up to 1200 unknown momentum coordinates (with fitted noise: coordinates), else L-BFGS
  kGaussNewton,  ///< Levenberg–Marquardt with dense Jacobians: few iterations
  kLbfgs,        ///< limited-memory quasi-Newton on the adjoint gradient: O(N²) an iteration, O(NK) memory
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
  double gradient_tolerance = 1e-3;
  /// Searches without noise, each from another way: straight on, turned aside to the left and right, then at random.
  int starts = 1;
  std::uint64_t seed = 1;  ///< of the random ways
  /// Called after each iteration, for progress.
  std::function<void(int iteration, double cost, double relative_gradient)> on_iteration{};
};

/// A local minimum, and how often searches ended there.
struct Minimum {
  MatchingCost cost;
  bool converged = false;
  int found = 1;
};

struct MinimiseSummary {
  Solver solver = Solver::kAuto;  ///< the one that was used
  bool converged = false;
  std::string reason{};  ///< why it stopped, in words
  std::string start{};   ///< where the search that found the solution began
  int iterations = 0;    ///< of all searches
  int evaluations = 0;
  Eigen::Index resolved = 0;    ///< unknowns that were moved; the others are too rough for the time step
  int continuation_stages = 0;  ///< solved with the data held less firmly, where a direct search did not converge
  double relative_gradient = 0;
  MatchingObjective::Evaluation solution{};
  std::vector<Minimum> minima{};  ///< distinct ones, lowest first
};

/// Minimises the objective, from the flow of the problem without noise and, where there is noise to be fitted, also
/// from landmarks that noise alone moves straight to their targets; the lowest minimum is returned. Where the direct
/// search from there does not converge, the data are first held less firmly, in stages.
MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options);

/// |∇J| / (|z| + |∇J − z|), 0 where both vanish.
double relative_gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient);

}  // namespace pulson
