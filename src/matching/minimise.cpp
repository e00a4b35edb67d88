#include "pulson/matching/minimise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "flow_start.hpp"
#include "solvers.hpp"

namespace pulson {
namespace {

constexpr std::array<std::pair<std::string_view, Solver>, 3> kNames = {
    {{"auto", Solver::kAuto}, {"gauss-newton", Solver::kGaussNewton}, {"lbfgs", Solver::kLbfgs}}};

// Beyond this many coordinates a Jacobian costs more than the iterations it saves.
constexpr Eigen::Index kGaussNewtonCoordinates = 800;

// Equal increments in all steps that carry each landmark straight to its target, as far as the noise can move it. K
// equal increments ΔW act as (K − ½)ΔW, since half of the last is lost: w_k = ½(ΔW_{k−1} + ΔW_k).
Eigen::MatrixXd straight_increments(const MatchingProblem& problem) {
  const PhaseState rest{problem.source, Points::Zero(problem.source.rows(), problem.source.cols())};
  const Points way = (problem.target - problem.source) / (problem.grid.steps - 0.5);
  const NoiseModel& noise = *problem.system.noise;
  // With B the map from increments to displacements: along Bᵀ·way, scaled so that B takes it to `way` where it can.
  Eigen::VectorXd increments = noise.contract(rest, {Points::Zero(way.rows(), way.cols()), way});
  const double reached = noise.gradient(rest, increments).p.squaredNorm();
  if (reached > 0) increments *= increments.squaredNorm() / reached;
  return increments.replicate(1, problem.grid.steps);
}

// Where searches begin: the flow without noise; and, where there is noise, the landmarks at rest but for the noise.
std::vector<Eigen::VectorXd> starting_points(const MatchingObjective& objective, int& iterations) {
  const MatchingProblem& problem = objective.problem();
  const int channels =
      problem.system.noise->channels(static_cast<int>(problem.source.rows()), static_cast<int>(problem.source.cols()));
  const FlowStart flow = flow_start(problem);
  iterations = flow.iterations;
  std::vector<Eigen::VectorXd> starts{
      objective.white(flow.momenta, Eigen::MatrixXd::Zero(channels, problem.grid.steps))};
  if (problem.system.noise->traits().moves_positions)
    starts.push_back(
        objective.white(Points::Zero(problem.source.rows(), problem.source.cols()), straight_increments(problem)));
  return starts;
}

// The path of z, or that of landmarks at rest where this costs less.
MatchingObjective::Evaluation better_start(const MatchingObjective& objective, const Eigen::VectorXd& z) {
  std::optional<MatchingObjective::Evaluation> rest = objective.evaluate(Eigen::VectorXd::Zero(objective.unknowns()));
  if (!rest) throw InputError("the distances to the target, divided by sigma, leave the range of numbers");
  std::optional<MatchingObjective::Evaluation> start = objective.evaluate(z);
  return start && start->cost.total() < rest->cost.total() ? std::move(*start) : std::move(*rest);
}

bool is_better(const MinimiseSummary& a, const MinimiseSummary& b) {
  return a.solution.cost.total() < b.solution.cost.total();
}

}  // namespace

Solver parse_solver(std::string_view name) {
  std::string valid;
  for (const auto& [known, solver] : kNames) {
    if (known == name) return solver;
    valid += (valid.empty() ? "" : ", ") + std::string(known);
  }
  throw InputError("unknown solver '" + std::string(name) + "'; valid: " + valid);
}

std::string solver_name(Solver solver) {
  for (const auto& [name, known] : kNames)
    if (known == solver) return std::string(name);
  return {};
}

double relative_gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient) {
  const double size = gradient.norm();
  const double scale = z.norm() + (gradient - z).norm();
  // Identical shapes: z = 0, r = 0, and nothing to do.
  return scale > 1e-12 ? size / scale : 0;
}

MinimiseSummary minimise(const MatchingObjective& objective, const MinimiseOptions& options) {
  const bool dense = options.solver == Solver::kGaussNewton ||
                     (options.solver == Solver::kAuto && objective.residuals() <= kGaussNewtonCoordinates);
  const auto solve = dense ? minimise_gauss_newton : minimise_lbfgs;
  int iterations = 0;
  int evaluations = 0;
  std::optional<MinimiseSummary> best;
  for (const Eigen::VectorXd& z : starting_points(objective, iterations)) {
    MinimiseSummary summary = solve(objective, options, better_start(objective, z));
    iterations += summary.iterations;
    evaluations += summary.evaluations;
    if (!best || is_better(summary, *best)) best = std::move(summary);
  }
  best->iterations = iterations;
  best->evaluations = evaluations;
  return std::move(*best);
}

}  // namespace pulson
