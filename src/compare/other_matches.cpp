// Matches of least cost, where there are several.

#include <algorithm>

#include "fitter.hpp"
#include "matching/global_search.hpp"
#include "matching/path_starts.hpp"
#include "matching/solvers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::compare {
namespace {

using Eigen::VectorXd;

constexpr double kLessCost = 0.01;   // nats, by which another match is better
constexpr double kOtherMatches = 3;  // nats of a path's cost above the least: energy counts at t = 0 in that of a match

// Within a standard deviation of the posterior.
bool is_same(const Linearised& match, const VectorXd& z) {
  const VectorXd apart = z - match.at.z;
  return apart.squaredNorm() + (match.jacobian * apart).squaredNorm() < 1;
}

// Whether landmarks meet on the path of a match, or would on straight paths.
bool may_have_others(const matching::MatchingObjective& objective, const Linearised& match) {
  if (matching::landmarks_meet(matching::straight_path(objective.problem()))) return true;
  const auto shot = objective.evaluate(match.at.z);
  if (!shot) return true;
  std::vector<Points> nodes;
  for (const PhaseState& state : shot->path().states) nodes.push_back(state.q);
  return matching::landmarks_meet(nodes);
}

}  // namespace

// Begins again at the paths of least cost for these numbers, of shapes that may have other matches: those whose
// landmarks come close to each other. @return whether that cost less for some shape
bool Fitter::improve(State& state) const {
  const matching::MatchingObjective objective = this->objective(state);
  std::vector<char> is_better(state.matches.size());
  parallel_for(static_cast<int>(state.matches.size()), [&](int s) {
    Linearised& match = state.matches[at(s)];
    const matching::MatchingObjective of_shape(problem(state, s));
    if (match.converged && !may_have_others(of_shape, match)) return;
    try {
      matching::MinimiseSummary counts;
      for (const VectorXd& guess : path_guesses(of_shape, {}, kOtherMatches, counts)) {
        if (is_same(match, guess)) continue;
        const VectorXd begin = minimise_from(of_shape, {}, guess).solution.z;
        Linearised other = find_match(objective, observations_[at(s)], {begin});
        if (!(other.cost < match.cost - kLessCost) || (match.converged && !other.converged)) continue;
        match = std::move(other);
        is_better[at(s)] = 1;
      }
    } catch (const NumericalError&) {
      // no path of least cost: the match stays
    }
  });
  return std::find(is_better.begin(), is_better.end(), 1) != is_better.end();
}

}  // namespace pulson::compare
