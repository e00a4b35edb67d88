#include "accuracy.hpp"

#include <algorithm>
#include <cmath>

#include "integrators/schemes.hpp"
#include "random/normals.hpp"

namespace pulson::matching {
namespace {

using Eigen::MatrixXd;

constexpr int kFewestSteps = 40;
constexpr int kPowers = 2;

// The controls are constant in each step of the record: within it the equation is an ordinary one, and of fourth order.
Trajectory accurate_shot(const MatchingProblem& problem, const Registration& registration) {
  const int steps = registration.grid.steps;
  const int finer = 2 * std::max(1, (kFewestSteps / 2 + steps - 1) / steps);
  const TimeGrid grid{registration.grid.time, finer * steps};
  MatrixXd increments(registration.increments.rows(), grid.steps);
  for (int k = 0; k < grid.steps; ++k) increments.col(k) = registration.increments.col(k / finer) / finer;
  ExplicitTableau tableau = rk4_tableau();
  tableau.noise = true;
  return RungeKuttaIntegrator(std::move(tableau))
      .integrate(problem.system, {problem.source, registration.momenta}, grid, increments);
}

// λ∫H dt, by Simpson's rule over each two steps.
double energy_by_simpson(const MatchingProblem& problem, const Trajectory& path) {
  double sum = 0;
  for (std::size_t k = 0; k < path.states.size(); ++k) {
    const bool at_end = k == 0 || k + 1 == path.states.size();
    sum += (at_end ? 1 : k % 2 == 1 ? 4 : 2) * hamiltonian(problem.system.kernel, path.states[k]);
  }
  return problem.lambda * path.grid.dt() / 3 * sum;
}

// The path of the landmarks that have momenta: without noise the others act on nothing.
Trajectory of_carriers(const Trajectory& path) {
  std::vector<Eigen::Index> carriers;
  for (Eigen::Index a = 0; a < path.initial().p.cols(); ++a)
    if (!path.initial().p.col(a).isZero(0)) carriers.push_back(a);
  Trajectory part = path;
  for (PhaseState& state : part.states)
    state = {state.q(Eigen::all, carriers).eval(), state.p(Eigen::all, carriers).eval()};
  for (Points& momenta : part.stage_momenta) momenta = momenta(Eigen::all, carriers).eval();
  return part;
}

}  // namespace

std::optional<DiscretisationError> step_error(const MatchingProblem& problem, const Registration& registration) {
  try {
    const Trajectory path = accurate_shot(problem, registration);
    const Points& end = path.final().q;
    const bool along_path = registration.solver == Solver::kPaths;
    const double energy = along_path ? energy_by_simpson(problem, path) - registration.cost.energy : 0;
    const DiscretisationError error{
        std::sqrt((end - registration.result).squaredNorm() / static_cast<double>(end.cols())),
        energy + problem.data->value(end) - registration.cost.data};
    if (std::isfinite(error.rms) && std::isfinite(error.cost)) return error;
  } catch (const StepError&) {
    // none
  }
  return std::nullopt;
}

std::optional<double> amplification(const StochasticSystem& system, const Trajectory& whole) {
  const RungeKuttaIntegrator linearised(heun_tableau());
  const bool is_free = whole.increments.rows() == 0 && !is_at_rest(system, whole.initial());
  const Trajectory path = is_free ? of_carriers(whole) : whole;
  const Points& q = path.initial().q;
  const Points none = Points::Zero(q.rows(), q.cols());
  PathChange change;
  change.initial = {standard_normals(1, 0, static_cast<int>(q.size()), 1).reshaped(q.rows(), q.cols()), none};
  change.increments = MatrixXd::Zero(path.increments.rows(), path.increments.cols());
  double largest = 0;
  for (int i = 0; i < kPowers; ++i) {
    if (i > 0) change.initial.q = linearised.adjoint(system, path, {change.initial.q, none}, false).q0_bar;
    change.initial.q /= change.initial.q.norm();
    change.initial.q = linearised.tangent(system, path, change).q;
    largest = change.initial.q.norm();
  }
  if (!std::isfinite(largest)) return std::nullopt;
  return largest;
}

}  // namespace pulson::matching
