#include <cmath>
#include <limits>
#include <utility>

#include "geodesic_search.hpp"
#include "global_search.hpp"
#include "matching/momentum_basis.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"
#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr EnumNames<Solver, 4> kSolverNames = {"solver",
                                               {{{"auto", Solver::kAuto},
                                                 {"paths", Solver::kPaths},
                                                 {"gauss-newton", Solver::kGaussNewton},
                                                 {"lbfgs", Solver::kLbfgs}}}};

// Beyond these a Jacobian costs more than the iterations it saves: its columns, and with fitted noise its rows.
constexpr Index kMostColumns = 1200;
constexpr Index kMostRows = 800;

using Evaluation = MatchingObjective::Evaluation;

bool fits_noise(const MatchingObjective& objective) { return objective.unknowns() > objective.basis().unknowns(); }

bool is_dense(const MatchingObjective& objective, Solver solver) {
  if (solver == Solver::kGaussNewton || solver == Solver::kLbfgs) return solver == Solver::kGaussNewton;
  return fits_noise(objective) ? objective.problem().source.size() <= kMostRows : objective.unknowns() <= kMostColumns;
}

Evaluation at_rest(const MatchingObjective& objective) {
  if (std::optional<Evaluation> rest = objective.evaluate(VectorXd::Zero(objective.unknowns())))
    return std::move(*rest);
  throw NumericalError(
      objective.problem().system.noise->traits().compensated
          ? "landmarks at rest have no path: either the noise is too strong for the time step (use more "
            "`grid.steps` or a smaller amplitude), or the distances to the target, divided by sigma, leave the "
            "range of numbers"
          : "the distances to the target, divided by sigma, leave the range of numbers");
}

// The unknowns of the best path: of the geodesic where no noise is fitted.
VectorXd path_start(const MatchingObjective& objective, const MinimiseOptions& options, MinimiseSummary& counts) {
  MatchingProblem problem = objective.problem();
  problem.lambda /= problem.grid.time;  // here the energy is λH, there λ∫H dt
  const MatrixXd still = objective.increments(VectorXd::Zero(objective.unknowns()));
  const auto unknowns = [&](const auto& found, const MatrixXd& increments) {
    counts.iterations = found.iterations;
    counts.evaluations = found.evaluations;
    return objective.white(found.momenta, increments);
  };
  if (fits_noise(objective) && problem.system.noise->traits().linear) {
    const PathSolution found = search_globally(problem, options);
    return unknowns(found, found.increments);
  }
  problem.system.noise = make_noise("none");
  problem.realisations.clear();
  if (problem.data->landmarks() == nullptr) return unknowns(search_globally(problem, options), still);
  return unknowns(search_geodesic(problem, options), still);
}

}  // namespace

Solver parse_solver(std::string_view name) { return kSolverNames.parse(name); }

std::string solver_name(Solver solver) { return kSolverNames.name(solver); }

double relative_gradient(const VectorXd& z, const VectorXd& gradient) {
  const double size = gradient.norm();
  const double scale = z.norm() + (gradient - z).norm();
  if (!std::isfinite(size) || !std::isfinite(scale)) return std::numeric_limits<double>::max();  // no minimum
  // Identical shapes: z = 0, r = 0, and nothing to do.
  return scale > 1e-12 ? size / scale : 0;
}

MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options) {
  const SerialBlas serial;
  Evaluation start = at_rest(objective);
  const bool dense = is_dense(objective, options.solver);
  if (start.cost.total() < kNegligibleCost)
    return {.solver = dense ? Solver::kGaussNewton : Solver::kLbfgs,
            .converged = true,
            .reason = reason_at_rest(objective.problem()),
            .evaluations = 1,
            .solution = std::move(start)};
  MinimiseSummary counts;
  const VectorXd on_path = path_start(objective, options, counts).cwiseProduct(objective.active_unknowns());
  if (std::optional<Evaluation> path = objective.evaluate(on_path); path && path->cost.total() < start.cost.total())
    start = std::move(*path);
  MinimiseSummary summary = dense ? minimise_gauss_newton(objective, options, std::move(start))
                                  : minimise_lbfgs(objective, options, std::move(start));
  summary.iterations += counts.iterations;
  summary.evaluations += counts.evaluations;
  return summary;
}

}  // namespace pulson::matching
