#include "pulson/matching/registration.hpp"

#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/core.h>

#include "accuracy.hpp"
#include "accurate_paths.hpp"
#include "core/text.hpp"
#include "dynamics/effective_hamiltonian.hpp"
#include "geodesic_search.hpp"
#include "global_search.hpp"
#include "noise_homotopy.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/landmark_predictions.hpp"
#include "pulson/matching/near_registration.hpp"
#include "pulson/noise/noise_table.hpp"
#include "registration_problem.hpp"
#include "shootable_momenta.hpp"
#include "shooting.hpp"

namespace pulson::matching {
namespace {

constexpr EnumNames<MatchingMode, 5> kModes = {"mode",
                                               {{{"deterministic", MatchingMode::kDeterministic},
                                                 {"metamorphosis", MatchingMode::kMetamorphosis},
                                                 {"map", MatchingMode::kMap},
                                                 {"pathwise", MatchingMode::kPathwise},
                                                 {"expected", MatchingMode::kExpected}}}};
constexpr int kMostWeightings = 10;  // fits, one for each set of weights

constexpr EnumNames<DataKind, 3> kDataKinds = {
    "data",
    {{{"landmarks", DataKind::kLandmarks}, {"varifold", DataKind::kVarifold}, {"current", DataKind::kCurrent}}}};

Points mean_end(const std::vector<Trajectory>& paths) {
  Points mean = paths.front().final().q;
  for (std::size_t s = 1; s < paths.size(); ++s) mean += paths[s].final().q;
  return mean / static_cast<double>(paths.size());
}

Points deviation_of_ends(const std::vector<Trajectory>& paths, const Points& mean) {
  if (paths.size() < 2) return {};
  Points squares = Points::Zero(mean.rows(), mean.cols());
  for (const Trajectory& path : paths) squares += (path.final().q - mean).cwiseAbs2();
  return (squares / static_cast<double>(paths.size())).cwiseSqrt();
}

void record_problem(const RegistrationProblem& problem, const RegistrationOptions& options,
                    Registration& registration) {
  registration.kernel = problem.matching.system.kernel.spec();
  registration.noise = problem.matching.system.noise->spec();
  if (options.noise.is_own() && problem.mode != MatchingMode::kDeterministic)
    registration.own_noise = problem.matching.system.noise;
  registration.mode = problem.mode;
  registration.integrator = problem.matching.integrator->name();
  registration.grid = options.grid;
  registration.sigma = problem.matching.sigma;
  registration.lambda = problem.matching.lambda;
  registration.data = problem.data;
  registration.seed = options.seed;
  registration.samples = std::max(1, static_cast<int>(problem.matching.realisations.size()));
  registration.alignment = problem.alignment;
  registration.fitted_kernel = problem.fitted_kernel;
  if (problem.robust)
    registration.robust = {loss_spec(*options.loss, problem.source.dimension()), problem.robust->weights};
  registration.source = problem.source;
  registration.original = problem.original;
  registration.target = problem.target;
  registration.notes = problem.notes;
}

// Of what is recorded already.
void record_accuracy(const MatchingProblem& problem, const Trajectory& path, Registration& registration) {
  registration.step_error = step_error(problem, registration);
  if (!registration.step_error)
    registration.notes.emplace_back(
        "an accurate integrator cannot follow the momenta, which grow beyond all bounds; try more `grid.steps`");
  registration.amplification = amplification(problem.system, path);
}

// rms over which drawn noise moves landmarks that are at rest.
std::optional<double> displacement_at_rest(const MatchingObjective& objective) {
  if (objective.problem().realisations.empty()) return std::nullopt;
  const auto rest = objective.evaluate(Eigen::VectorXd::Zero(objective.unknowns()));
  if (!rest) return std::nullopt;
  const Points& q0 = objective.problem().source;
  double sum = 0;
  for (const Trajectory& path : rest->paths) sum += (path.final().q - q0).squaredNorm();
  return std::sqrt(sum / static_cast<double>(rest->paths.size()) / static_cast<double>(q0.cols()));
}

void record_solution(const ShootingSolution& solution, Registration& registration) {
  const MatchingObjective objective(solution.problem);
  const MinimiseSummary& summary = solution.summary;
  const MatchingObjective::Evaluation& at = summary.solution;
  registration.grid = solution.problem.grid;
  registration.result = mean_end(at.paths);
  registration.spread = deviation_of_ends(at.paths, registration.result);
  registration.momenta = objective.momenta(at.z);
  registration.increments = solution.increments;
  if (registration.mode == MatchingMode::kExpected) registration.increments.setZero();
  registration.cost = solution.cost;
  registration.extrapolated = solution.extrapolated;
  registration.noise_displacement = displacement_at_rest(objective);
  registration.solver = summary.solver;
  registration.converged = summary.converged;
  registration.stop_reason = summary.reason;
  registration.iterations = summary.iterations;
  registration.evaluations = summary.evaluations;
  registration.unknowns = objective.unknowns();
  registration.relative_gradient = summary.relative_gradient;
  if (registration.mode == MatchingMode::kExpected) return;
  Trajectory path = at.path();
  path.increments = solution.increments;
  record_accuracy(objective.problem(), path, registration);
}

bool is_shot_metamorphosis(const Registration& registration) {
  return registration.mode == MatchingMode::kMetamorphosis && registration.integrator == "variational";
}

bool by_paths(const Registration& registration, const MinimiseOptions& how) {
  return (registration.integrator == "midpoint" || registration.integrator == "rk4") &&
         (registration.mode == MatchingMode::kDeterministic || registration.mode == MatchingMode::kMetamorphosis) &&
         (how.solver == Solver::kAuto || how.solver == Solver::kPaths);
}

ShootingOptions shooting_options(const RegistrationProblem& problem, const RegistrationOptions& options,
                                 const MinimiseOptions& how) {
  ShootingOptions shooting{.minimise = how, .more_steps = options.more_steps};
  shooting.extrapolate = how.solver == Solver::kShooting;
  const int frozen = static_cast<int>(problem.matching.realisations.size());
  if (frozen == 0) return shooting;
  shooting.follow_noise = problem.mode == MatchingMode::kPathwise;
  shooting.draw = [noise = problem.matching.system.noise, q0 = problem.matching.source, seed = options.seed,
                   frozen](const TimeGrid& grid) { return realisations(*noise, q0, grid, seed, frozen); };
  return shooting;
}

LaplaceApproximation uncertainty_of(const MatchingProblem& problem, const Registration& registration) {
  const MatchingObjective objective(problem);
  const Points& p0 = registration.states.empty() ? registration.momenta : registration.states.front().p;
  if (const auto at = objective.evaluate(objective.white(p0, registration.increments))) return laplace(objective, *at);
  throw NumericalError("the uncertainty needs smaller time steps; use more `grid.steps`");
}

template <class Solution>
void record_search(const Solution& found, Registration& registration) {
  registration.momenta = found.momenta;
  registration.solver = Solver::kPaths;
  registration.converged = found.converged;
  registration.stop_reason = found.reason;
  registration.iterations = found.iterations;
  registration.evaluations = found.evaluations;
  registration.unknowns = found.momenta.size();
  registration.relative_gradient = found.relative_gradient;
  registration.minima = found.minima;
}

// Searches from several starts take the steps of the grid, which more may have refined, and their paths are not shot: J
// of the minima in proportion to that recorded.
void scale_minima(Registration& registration) {
  std::vector<Minimum>& minima = registration.minima;
  if (minima.empty() || !(minima.front().total > 0)) return;
  const double factor = registration.cost.total() / minima.front().total;
  for (Minimum& minimum : minima) {
    minimum.total *= factor;
    minimum.log_weight *= factor;
  }
  minima.front().total = registration.cost.total();
}

void record_path(const MatchingProblem& problem, const Points& end, const MatchingCost& cost,
                 Registration& registration) {
  registration.result = end;
  registration.cost = cost;
  scale_minima(registration);
  registration.amplification = amplification(problem.system, replay(registration));
}

void record_geodesic(const MatchingProblem& problem, const MinimiseOptions& how, bool more_steps,
                     const std::vector<Points>& near, Registration& registration) {
  const GeodesicSolution found = search_geodesic(problem, how, more_steps, near);
  record_search(found, registration);
  registration.integrator = found.integrator;
  registration.grid = found.grid;
  registration.increments = Eigen::MatrixXd::Zero(0, registration.grid.steps);
  registration.states = found.states;
  // By H(q0, p0), which is more accurate than a sum over steps.
  const Points end = replay(registration).final().q;
  const double energy = problem.lambda * found.grid.time *
                        hamiltonian(problem.system.kernel, {registration.source.points, found.momenta});
  record_path(problem, end, {energy, 0, problem.data->value(end)}, registration);
  registration.step_error = step_error(problem, registration);
}

// From the path of coarse data, which have few minima: those of curves have one for every detail of the outlines.
PathSolution search_curves(const MatchingProblem& problem, const std::shared_ptr<const DataTerm>& coarse_data,
                           const MinimiseOptions& how, bool more_steps) {
  MatchingProblem coarse = problem;
  coarse.data = coarse_data;
  const PathSolution first = search_paths(coarse, how, nullptr, Finish::kShootable);
  PathSolution found =
      more_steps ? search_accurate_paths(problem, how, &first.fields) : search_paths(problem, how, &first.fields);
  found.iterations += first.iterations;
  found.evaluations += first.evaluations;
  found.minima = {{found.cost.total(), 1, 0}};
  return found;
}

// On a line the fields of a narrow kernel do not let landmarks pass each other in a step; velocities do.
void let_pass_on_line(const MatchingProblem& problem, const MinimiseOptions& how, bool more_steps,
                      PathSolution& found) {
  if (found.converged || found.path.keeps_velocities || problem.data->landmarks() == nullptr || how.is_interrupted() ||
      !moves_each_along_line(noise_cometric(*problem.system.noise, problem.source), problem.source))
    return;
  PathSolution passing = search_from_much_noise(problem, how, Finish::kRoundOff);
  if (!(passing.cost.total() < found.cost.total())) return;
  passing.iterations += found.iterations;
  passing.evaluations += found.evaluations;
  found = more_steps ? in_enough_steps(problem, how, std::move(passing)) : std::move(passing);
  found.minima = {{found.cost.total(), 1, 0}};
}

void record_paths(const RegistrationProblem& of, const MinimiseOptions& how, bool more_steps,
                  const std::vector<Points>& near, Registration& registration) {
  const MatchingProblem& problem = of.matching;
  if (registration.integrator == "rk4") return record_geodesic(problem, how, more_steps, near, registration);
  PathSolution found = of.coarse_data  ? search_curves(problem, of.coarse_data, how, more_steps)
                       : more_steps    ? search_accurate_paths(problem, how)
                       : !near.empty() ? search_near(problem, how, near)
                                       : search_globally(problem, how);
  let_pass_on_line(problem, how, more_steps, found);
  record_search(found, registration);
  registration.grid = found.path.grid;
  registration.increments = found.increments;
  registration.states = found.states;
  record_path(problem, found.path.end(), found.cost, registration);
  ShootableMomenta shot = shootable_momenta(problem, how, found);
  registration.momenta = std::move(shot.momenta);
  registration.step_error = shot.error;
}

Registration solved(const RegistrationProblem& problem, const RegistrationOptions& options, const MinimiseOptions& how,
                    const std::vector<Points>& near = {}) {
  const MatchingProblem& matching = problem.matching;
  Registration registration;
  record_problem(problem, options, registration);
  if (by_paths(registration, how)) {
    record_paths(problem, how, options.more_steps, near, registration);
    if (options.uncertainty) registration.uncertainty = uncertainty_of(matching, registration);
  } else {
    const ShootingSolution found = shoot(matching, shooting_options(problem, options, how));
    record_solution(found, registration);
    if (options.uncertainty)
      registration.uncertainty = laplace(MatchingObjective(found.problem), found.summary.solution);
  }
  return registration;
}

// A path beyond the range of numbers is no match, whatever the search made of it.
void require_finite_result(const Registration& registration) {
  const auto refuse = [](std::string_view what) {
    throw NumericalError(
        fmt::format("the search left the range of numbers: {} not finite; the length of time, lambda, sigma or "
                    "the width of the kernel is too large or too small for these shapes",
                    what));
  };
  if (!std::isfinite(registration.cost.total())) refuse("the cost is");
  if (!registration.momenta.allFinite()) refuse("the momenta are");
  if (!registration.increments.allFinite()) refuse("the increments of the noise are");
  if (!registration.result.allFinite()) refuse("the end points are");
}

Trajectory mean_path(const std::vector<Trajectory>& paths) {
  Trajectory mean = paths.front();
  const auto count = static_cast<double>(paths.size());
  mean.increments.setZero();
  mean.stage_momenta.clear();
  for (std::size_t k = 0; k < mean.states.size(); ++k) {
    for (std::size_t s = 1; s < paths.size(); ++s) {
      mean.states[k].q += paths[s].states[k].q;
      mean.states[k].p += paths[s].states[k].p;
    }
    mean.states[k].q /= count;
    mean.states[k].p /= count;
  }
  return mean;
}

}  // namespace

MatchingMode parse_mode(std::string_view name) { return kModes.parse(name); }

std::string mode_name(MatchingMode mode) { return kModes.name(mode); }

DataKind parse_data_kind(std::string_view name) { return kDataKinds.parse(name); }

std::string data_kind_name(DataKind kind) { return kDataKinds.name(kind); }

namespace {

void require_path_of(const std::vector<Points>& path, const Points& source) {
  if (path.size() < 2) throw InputError(fmt::format("the path to begin near has {} nodes; it needs two", path.size()));
  for (const Points& nodes : path) {
    require_size("the path to begin near", nodes, source.rows(), source.cols());
    if (!nodes.allFinite()) throw InputError("the path to begin near has numbers that are not finite");
  }
}

Registration registered(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options,
                        const std::vector<Points>& near) {
  const SerialBlas serial;
  const auto start = std::chrono::steady_clock::now();
  RegistrationProblem problem = make_problem(source, target, options);
  if (!near.empty()) require_path_of(near, problem.source.points);
  MinimiseOptions how = options.minimise;
  how.seed = options.seed;
  Registration registration = solved(problem, options, how, near);
  for (int i = 1; i < kMostWeightings && registration.result.allFinite() && !how.is_interrupted(); ++i) {
    if (!reweight(problem, registration.result)) break;
    registration = solved(problem, options, how);
  }
  if (how.is_interrupted()) {
    registration.converged = false;
    registration.stop_reason = kInterrupted;
  }
  require_finite_result(registration);
  registration.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return registration;
}

}  // namespace

Registration register_shapes(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options) {
  return registered(source, target, options, {});
}

Registration register_near(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options,
                           const std::vector<Points>& path) {
  if (path.empty()) throw InputError("there is no path to begin near");
  return registered(source, target, options, path);
}

std::shared_ptr<const NoiseModel> registration_noise(const Registration& registration) {
  return registration.own_noise ? registration.own_noise : make_noise(registration.noise, registration.source);
}

StochasticSystem registration_system(const Registration& registration) {
  std::shared_ptr<const NoiseModel> noise = registration_noise(registration);
  if (is_shot_metamorphosis(registration)) noise = control_energy(std::move(noise), registration.lambda);
  return {make_kernel(registration.kernel, registration.source.points), std::move(noise)};
}

Trajectory replay(const Registration& registration) {
  const SerialBlas serial;
  const StochasticSystem system = registration_system(registration);
  const auto integrator = make_integrator(registration.integrator);
  if (!registration.states.empty())
    return {registration.integrator, registration.grid, registration.increments, registration.states, {}};
  const PhaseState start{registration.source.points, registration.momenta};
  if (is_shot_metamorphosis(registration))
    return integrator->integrate(system, start, registration.grid, Eigen::MatrixXd::Zero(0, registration.grid.steps));
  if (registration.mode != MatchingMode::kExpected)
    return integrator->integrate(system, start, registration.grid, registration.increments);
  std::vector<Trajectory> paths;
  for (const Eigen::MatrixXd& increments : realisations(*system.noise, registration.source.points, registration.grid,
                                                        registration.seed, registration.samples))
    paths.push_back(integrator->integrate(system, start, registration.grid, increments));
  return mean_path(paths);
}

int order_inversions(const Points& before, const Points& after) { return exchanged_as_asked(before, after, after); }

int exchanged_as_asked(const Points& before, const Points& after, const Points& end) {
  for (const Points* points : {&before, &after, &end}) require_size("landmarks on a line", *points, 1, before.cols());
  const auto differs = [&](const Points& points, Eigen::Index a, Eigen::Index b) {
    return (before(0, a) - before(0, b)) * (points(0, a) - points(0, b)) < 0;
  };
  int count = 0;
  for (Eigen::Index b = 1; b < before.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a)
      if (differs(after, a, b) && differs(end, a, b)) ++count;
  return count;
}

}  // namespace pulson::matching
