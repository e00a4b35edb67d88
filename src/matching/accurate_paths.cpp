#include "accurate_paths.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "dynamics/effective_hamiltonian.hpp"
#include "global_search.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

// At the middles of half steps, from those of whole ones.
std::vector<Points> momenta_of_halves(const DiscretePath& path) {
  std::vector<Points> halves;
  const auto last = path.middles.size() - 1;
  for (std::size_t k = 0; k <= last; ++k) {
    // A parabola through three middles, a quarter of a step before and after the one.
    const std::size_t centre = std::clamp<std::size_t>(k, 1, last - 1);
    const double from = static_cast<double>(k) - static_cast<double>(centre);
    for (const double t : {from - 0.25, from + 0.25})
      halves.emplace_back(0.5 * t * (t - 1) * path.middles[centre - 1].p + (1 - t * t) * path.middles[centre].p +
                          0.5 * t * (t + 1) * path.middles[centre + 1].p);
  }
  return halves;
}

// Whether the same path in twice as many steps has the same energy, Σ p·δq − Δt ½ p·A(q̄)p at the greatest, of which
// interpolated momenta are next to. Too few steps to tell are not refined, nor are searches on a line whose cost
// settled while the gradient did not vanish: where landmarks meet within steps, twice as many change the path.
bool is_accurate(const MatchingProblem& problem, const MinimiseOptions& options, const PathSolution& solution) {
  const DiscretePath& path = solution.path;
  if (path.grid.steps < 3 || solution.relative_gradient > options.gradient_tolerance) return true;
  const EffectiveHamiltonian system(problem.system, problem.lambda);
  const std::vector<Points> nodes = resampled(path.nodes, 2 * path.grid.steps);
  const std::vector<Points> momenta = momenta_of_halves(path);
  std::vector<double> energies(momenta.size());
  parallel_for(2 * path.grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    const Points& p = momenta[k];
    const Points change = nodes[k + 1] - nodes[k];
    energies[k] =
        p.cwiseProduct(change).sum() - 0.5 * path.grid.dt() * system.value({0.5 * (nodes[k] + nodes[k + 1]), p});
  });
  const double energy = std::accumulate(energies.begin(), energies.end(), 0.0);
  return problem.lambda * std::abs(energy - path.energy) <= kAccurate * solution.cost.total();
}

StepFields in_halves(const StepFields& fields) {
  StepFields finer;
  const auto twice = [](const auto& from, auto& to) {
    for (const auto& x : from) to.insert(to.end(), 2, x);
  };
  twice(fields.centres, finer.centres);
  twice(fields.momenta, finer.momenta);
  twice(fields.controls, finer.controls);
  twice(fields.own, finer.own);
  return finer;
}

// On a line from the same nodes, since landmarks that pass each other leave the fields.
PathSolution continued(const MatchingProblem& finer, const MinimiseOptions& options, const PathSolution& found) {
  if (found.path.keeps_velocities) {
    auto path =
        along({finer.system, finer.lambda}, finer.grid, resampled(found.path.nodes, finer.grid.steps), nullptr, true);
    if (path) return continue_path(finer, options, std::move(*path), Finish::kRoundOff);
  }
  const StepFields fields = in_halves(found.fields);
  return search_paths(finer, options, &fields);
}

}  // namespace

PathSolution search_accurate_paths(const MatchingProblem& problem, const MinimiseOptions& options,
                                   const StepFields* start) {
  return in_enough_steps(problem, options,
                         start == nullptr ? search_globally(problem, options) : search_paths(problem, options, start));
}

PathSolution in_enough_steps(const MatchingProblem& problem, const MinimiseOptions& options, PathSolution found) {
  MatchingProblem finer = problem;
  while (found.converged && finer.grid.steps < kMostSteps * problem.grid.steps &&
         !is_accurate(problem, options, found)) {
    finer.grid.steps *= 2;
    PathSolution next = continued(finer, options, found);
    if (!next.converged) break;  // or interrupted
    next.iterations += found.iterations;
    next.evaluations += found.evaluations;
    next.minima = std::move(found.minima);
    const double change = std::abs(next.cost.total() - found.cost.total());
    found = std::move(next);
    if (change <= 3 * kAccurate * found.cost.total()) break;  // the error is of second order: a third of it is left
  }
  return found;
}

}  // namespace pulson::matching
