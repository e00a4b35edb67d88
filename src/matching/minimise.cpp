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

constexpr EnumNames<Solver, 5> kSolverNames = {"solver",
                                               {{{"auto", Solver::kAuto},
                                                 {"paths", Solver::kPaths},
                                                 {"shooting", Solver::kShooting},
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

std::vector<VectorXd> path_guesses(const MatchingObjective& objective, const MinimiseOptions& options, double within,
                                   MinimiseSummary& counts) {
  MatchingProblem problem = objective.problem();
  const bool with_action =
      pays_for_controls(problem) || (fits_noise(objective) && problem.system.noise->traits().linear);
  if (!problem.along_path) problem.lambda /= problem.grid.time;  // here the energy is λH, there λ∫H dt
  if (!with_action) {
    problem.system.noise = make_noise("none");
    problem.realisations.clear();
  }
  const MatrixXd still = objective.increments(VectorXd::Zero(objective.unknowns()));
  const auto guesses = [&](const auto& found, const MatrixXd& increments) {
    counts.iterations += found.iterations;
    counts.evaluations += found.evaluations;
    std::vector<VectorXd> all{objective.white(found.momenta, increments)};
    for (std::size_t i = 0; i < found.others.size(); ++i) {
      if (found.others[i].empty() || found.minima[i + 1].total > found.minima.front().total + within) continue;
      const auto other = search_along(problem, options, found.others[i], Finish::kShootable);
      if (other) all.push_back(objective.white(other->momenta, with_action ? other->increments : still));
    }
    return all;
  };
  if (with_action) {
    const PathSolution found = search_globally(problem, options);
    return guesses(found, found.increments);
  }
  if (problem.data->landmarks() == nullptr) return guesses(search_globally(problem, options), still);
  return guesses(search_geodesic(problem, options), still);
}

MinimiseSummary minimise_from(const MatchingObjective& objective, const MinimiseOptions& options, const VectorXd& z) {
  Evaluation start = at_rest(objective);
  const VectorXd active = z.cwiseProduct(objective.active_unknowns());
  if (std::optional<Evaluation> path = objective.evaluate(active); path && path->cost.total() < start.cost.total())
    start = std::move(*path);
  return minimise_at(objective, options, std::move(start));
}

MinimiseSummary minimise_at(const MatchingObjective& objective, const MinimiseOptions& options, Evaluation start) {
  return is_dense(objective, options.solver) ? minimise_gauss_newton(objective, options, std::move(start))
                                             : minimise_lbfgs(objective, options, std::move(start));
}

MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options) {
  const SerialBlas serial;
  Evaluation rest = at_rest(objective);
  if (rest.cost.total() < kNegligibleCost)
    return {.solver = is_dense(objective, options.solver) ? Solver::kGaussNewton : Solver::kLbfgs,
            .converged = true,
            .reason = reason_at_rest(objective.problem()),
            .evaluations = 1,
            .solution = std::move(rest)};
  constexpr double kNoOthers = -std::numeric_limits<double>::infinity();
  MinimiseSummary counts;
  MinimiseSummary summary =
      minimise_from(objective, options, path_guesses(objective, options, kNoOthers, counts).front());
  summary.iterations += counts.iterations;
  summary.evaluations += counts.evaluations;
  return summary;
}

}  // namespace pulson::matching
