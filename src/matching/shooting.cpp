// Shooting from the best path of a search over paths, in more steps until the cost is known.
//
// A method of order r has J(K) = J + c/K^r + …, so that (2^r J(2K) − J(K)) / (2^r − 1) is J to higher order
// (Richardson). K is doubled until that is next to J(2K), or to the value before.
//
// Where p0 is fitted under drawn noise, the path of the geodesic is far from any path through the noise, and the valley
// of J is as narrow as σ. For one realisation p0 follows the noise as it grows from nothing: with β = 20 % of the
// diameter on the two outlines `cs`, 85 iterations end at J = 153 where 200 from the geodesic stop at 1803. For several
// the noise cannot be undone, and the search begins at rest: 31 iterations in 40 steps, where a quasi-Newton search
// from the geodesic ended at twice the cost (80 steps, 153 iterations). K is doubled where a step does not contract, or
// for several has no root.

#include "shooting.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "accurate_paths.hpp"
#include "dynamics/effective_hamiltonian.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/noise/noise_table.hpp"
#include "solvers.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of the first number of steps: under drawn noise, whose landmarks may come close at any time.
constexpr int kMostDrawnSteps = 64;
// Of the strength of the noise: the first step along it, and the least, below which the steps of the path are halved.
constexpr double kFirstGrowth = 0.125, kLeastGrowth = 1.0 / 16;
// On the way the minimum is followed loosely: of J a hundredth, in a dozen iterations, or the step is halved.
constexpr double kLooseGradient = 0.1;
constexpr int kMostLooseIterations = 12;
// Of the standard error of J over realisations: what a third adds to the whole, in squares, is a twentieth. 8
// realisations of ch-sd:beta=20% on `cs` take 12 iterations in place of 64, to 1.4 % more (40 steps); another seed
// changes J by 6 %.
constexpr double kPartOfSamplingError = 1.0 / 3;

MatrixXd in_halves(const MatrixXd& increments) {
  MatrixXd halves(increments.rows(), 2 * increments.cols());
  for (Index k = 0; k < increments.cols(); ++k) halves.middleCols(2 * k, 2).colwise() = 0.5 * increments.col(k);
  return halves;
}

MatchingCost operator+(const MatchingCost& a, const MatchingCost& b) {
  return {a.energy + b.energy, a.action + b.action, a.data + b.data};
}
MatchingCost operator*(double factor, const MatchingCost& a) {
  return {factor * a.energy, factor * a.action, factor * a.data};
}

// u Δt of the steps of H_tot: λh(q⁺, p)Δt.
MatrixXd controls_along(const MatchingProblem& problem, const Trajectory& path) {
  const EffectiveHamiltonian total(problem.system, problem.lambda);
  const PhaseState& first = path.initial();
  MatrixXd increments(total.controls(first).size(), path.grid.steps);
  for (int k = 0; k < path.grid.steps; ++k)
    increments.col(k) =
        path.grid.dt() * total.controls({path.states[static_cast<std::size_t>(k) + 1].q, path.step_momenta(k)});
  return increments;
}

class Shooting {
 public:
  Shooting(MatchingProblem problem, const ShootingOptions& options) : problem_(std::move(problem)), options_(options) {}

  ShootingSolution run() {
    ShootingSolution solution = options_.draw ? through_drawn_noise() : over_all();
    solution.summary.iterations += counts_.iterations;
    solution.summary.evaluations += counts_.evaluations;
    return solution;
  }

 private:
  bool interrupted() const { return options_.minimise.is_interrupted(); }

  ShootingSolution over_all() {
    ShootingSolution found = first_solution();
    if (!options_.extrapolate && !options_.more_steps) return found;
    if (!options_.more_steps) return beside_half_the_steps(std::move(found));
    const int most = kMostSteps * problem_.grid.steps;
    while (found.problem.grid.steps < most && !interrupted() && !is_settled(found) && finer_may_help(found)) {
      ShootingSolution finer = refined(found);
      if (found.summary.converged && finer.summary.converged) finer.extrapolated = extrapolation(found, finer);
      found = std::move(finer);
    }
    return found;
  }

  ShootingSolution first_solution() {
    const MatchingObjective objective(problem_);
    return solution_of(objective, counted(minimise(objective, options_.minimise)));
  }

  // What is left of the error, in parts of J.
  static bool is_settled(const ShootingSolution& found) {
    return found.extrapolated && found.extrapolated->error <= kAccurate * found.cost.total();
  }

  static bool finer_may_help(const ShootingSolution& found) {
    return found.summary.converged || found.summary.reason == kTooCoarse;
  }

  ShootingSolution refined(const ShootingSolution& found) {
    MatchingProblem finer = found.problem;
    finer.grid.steps *= 2;
    const MatchingObjective objective(finer), coarser(found.problem);
    const VectorXd& z = found.summary.solution.z;
    return solution_of(objective,
                       counted(minimise_from(objective, options_.minimise,
                                             objective.white(coarser.momenta(z), in_halves(coarser.increments(z))))));
  }

  // Given so many steps, J is extrapolated by a search in half as many.
  ShootingSolution beside_half_the_steps(ShootingSolution found) {
    if (found.problem.grid.steps % 2 != 0 || !found.summary.converged || interrupted()) return found;
    MatchingProblem half = found.problem;
    half.grid.steps /= 2;
    const MatchingObjective objective(half), finer(found.problem);
    const VectorXd& z = found.summary.solution.z;
    const MatrixXd increments = finer.increments(z);
    MatrixXd pairs(increments.rows(), half.grid.steps);
    for (Index k = 0; k < pairs.cols(); ++k) pairs.col(k) = increments.middleCols(2 * k, 2).rowwise().sum();
    const ShootingSolution coarse = solution_of(
        objective, counted(minimise_from(objective, options_.minimise, objective.white(finer.momenta(z), pairs))));
    if (coarse.summary.converged) found.extrapolated = extrapolation(coarse, found);
    return found;
  }

  static ExtrapolatedCost extrapolation(const ShootingSolution& coarse, const ShootingSolution& fine) {
    const double gain = std::pow(2, fine.problem.integrator->traits().order);
    ExtrapolatedCost result{1 / (gain - 1) * (gain * fine.cost + -1.0 * coarse.cost), coarse.problem.grid.steps, 0};
    const double to_finer = std::abs(result.cost.total() - fine.cost.total());
    const double to_before = coarse.extrapolated ? std::abs(result.cost.total() - coarse.extrapolated->cost.total())
                                                 : std::numeric_limits<double>::infinity();
    result.error = std::min(to_finer, to_before);
    return result;
  }

  ShootingSolution solution_of(const MatchingObjective& objective, MinimiseSummary summary) const {
    ShootingSolution solution{objective.problem(), std::move(summary), {}, {}, std::nullopt};
    const Trajectory& path = solution.summary.solution.path();
    solution.cost = solution.summary.solution.cost;
    solution.increments = path.increments;
    if (!pays_for_controls(solution.problem)) return solution;
    solution.increments = controls_along(solution.problem, path);
    solution.cost.action = 0.5 * solution.increments.squaredNorm() / path.grid.dt();
    solution.cost.energy -= solution.cost.action;
    return solution;
  }

  MinimiseSummary counted(MinimiseSummary summary) {
    counts_.iterations += summary.iterations;
    counts_.evaluations += summary.evaluations;
    summary.iterations = summary.evaluations = 0;
    return summary;
  }

  // ---- under drawn noise ----

  ShootingSolution through_drawn_noise() {
    const int most = (options_.more_steps ? kMostDrawnSteps : 1) * problem_.grid.steps;
    Points momenta = options_.follow_noise ? geodesic() : Points::Zero(problem_.source.rows(), problem_.source.cols());
    double strength = options_.follow_noise ? 0 : 1;
    MatchingProblem at = problem_;
    for (;; at.grid.steps *= 2) {
      at.realisations = options_.draw(at.grid);
      const bool last = 2 * at.grid.steps > most;
      if (follow(at, strength, momenta) || last) {
        const MatchingObjective objective(at);
        const auto rest = objective.evaluate(VectorXd::Zero(objective.unknowns()));
        if (!last && !rest) continue;
        MinimiseOptions how = options_.minimise;
        if (rest) how.gradient_tolerance = std::max(how.gradient_tolerance, sampling_tolerance(objective, *rest));
        ShootingSolution found =
            solution_of(objective, counted(minimise_from(objective, how, objective.white(momenta, MatrixXd()))));
        if (found.summary.converged && found.summary.relative_gradient > options_.minimise.gradient_tolerance)
          found.summary.reason = "no more is left to gain than so few realisations can tell";
        if (last || interrupted() || found.summary.reason != kTooCoarse) return found;
        momenta = objective.momenta(found.summary.solution.z);
      }
    }
  }

  // The mean over realisations is known to its standard error alone: the relative gradient at which no more than a part
  // of that is left to gain. 0 for one realisation.
  static double sampling_tolerance(const MatchingObjective& objective, const MatchingObjective::Evaluation& rest) {
    const auto count = static_cast<Index>(rest.paths.size());
    if (count < 2) return 0;
    VectorXd data(count);
    for (Index s = 0; s < count; ++s)
      data[s] = objective.problem().data->value(rest.paths[static_cast<std::size_t>(s)].final().q);
    const double deviation = std::sqrt((data.array() - data.mean()).square().sum() / static_cast<double>(count - 1));
    return std::sqrt(kPartOfSamplingError * deviation / std::sqrt(static_cast<double>(count)) / data.mean());
  }

  Points geodesic() {
    MatchingProblem still = problem_;
    still.system.noise = make_noise("none");
    still.realisations.clear();
    const MatchingObjective objective(still);
    return objective.momenta(
        path_guesses(objective, options_.minimise, -std::numeric_limits<double>::infinity(), counts_).front());
  }

  // What becomes of momenta in a few iterations under noise of some strength.
  struct Followed {
    Points momenta;
    bool converged = false;
    bool too_coarse = false;
  };
  Followed minimum_at(const MatchingProblem& at, double strength, const Points& momenta) {
    MatchingProblem weaker = at;
    for (MatrixXd& realisation : weaker.realisations) realisation *= strength;
    const MatchingObjective objective(weaker);
    std::optional<MatchingObjective::Evaluation> start = objective.evaluate(objective.white(momenta, MatrixXd()));
    if (!start) return {.momenta = {}, .converged = false, .too_coarse = true};
    MinimiseOptions loose = options_.minimise;
    loose.gradient_tolerance = std::max(loose.gradient_tolerance, kLooseGradient);
    loose.max_iterations = std::min(loose.max_iterations, kMostLooseIterations);
    const MinimiseSummary summary = counted(minimise_at(objective, loose, std::move(*start)));
    return {objective.momenta(summary.solution.z), summary.converged, summary.reason == kTooCoarse};
  }

  // Momenta that follow the noise to its full strength; false where these steps are too long for it.
  bool follow(const MatchingProblem& at, double& strength, Points& momenta) {
    Points before = momenta;
    double strength_before = strength;
    for (double growth = kFirstGrowth; strength < 1 && !interrupted();) {
      const double next = std::min(1.0, strength + growth);
      const Points ahead = strength > strength_before
                               ? Points(momenta + (next - strength) / (strength - strength_before) * (momenta - before))
                               : momenta;
      Followed found = minimum_at(at, next, ahead);
      const bool least = growth <= kLeastGrowth;
      if (found.too_coarse && least) return false;
      if (!found.converged && !least) {
        growth /= 2;
        continue;
      }
      before = std::exchange(momenta, std::move(found.momenta));
      strength_before = std::exchange(strength, next);
      if (found.converged) growth *= 1.5;
    }
    return strength == 1;
  }

  MatchingProblem problem_;
  const ShootingOptions& options_;
  MinimiseSummary counts_;
};

}  // namespace

ShootingSolution shoot(MatchingProblem problem, const ShootingOptions& options) {
  return Shooting(std::move(problem), options).run();
}

}  // namespace pulson::matching
