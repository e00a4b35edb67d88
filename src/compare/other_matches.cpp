// Matches of least cost, where there are several.

#include <algorithm>

#include "cohort_model.hpp"
#include "matching/global_search.hpp"
#include "matching/path_starts.hpp"
#include "matching/solvers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::Minimum;
using posterior::Specimen;

constexpr double kLessCost = 0.01;   // nats, by which another match is better: a hundred times what a search leaves
constexpr double kOtherMatches = 3;  // nats of a path's cost above the least: energy counts at t = 0 in that of a match

// Within a standard deviation of the posterior.
bool is_same(const Minimum& match, const Specimen::Model& model, const VectorXd& z) {
  const VectorXd apart = z - match.z;
  return apart.squaredNorm() + LinearAt(*match.linear, model).apply(apart).squaredNorm() < 1;
}

// Whether landmarks meet on the path of a match, or would on straight paths.
bool may_have_others(const Specimen& specimen, const Specimen::Model& model, const Minimum& match) {
  if (matching::landmarks_meet(matching::straight_path(specimen.problem()))) return true;
  const auto shot = specimen.shoot(model, match.z);
  if (!shot) return true;
  std::vector<Points> nodes;
  for (const PhaseState& state : shot->paths.front().states) nodes.push_back(state.q);
  return matching::landmarks_meet(nodes);
}

}  // namespace

bool CohortModel::improve(Matches& matches) const {
  const posterior::Numbers numbers = this->numbers(matches.x);
  std::vector<char> is_better(specimens_.size());
  parallel_for(shapes(), [&](int shape) {
    const auto s = static_cast<std::size_t>(shape);
    Minimum& match = matches.minima[s];
    const Specimen& specimen = specimens_[s];
    if (match.converged && !may_have_others(specimen, matches.model, match)) return;
    try {
      const matching::MatchingObjective objective(problem(numbers, shape));
      const auto white = [&](const VectorXd& z) {
        return specimen.white(matches.model, objective.momenta(z), objective.increments(z));
      };
      matching::MinimiseSummary counts;
      for (const VectorXd& guess : path_guesses(objective, {}, kOtherMatches, counts)) {
        if (is_same(match, matches.model, white(guess))) continue;
        const VectorXd begin = white(minimise_from(objective, {}, guess).solution.z);
        Minimum other = find_minima({&specimen}, matches.model, {{begin}}).front();
        if (!(other.cost < match.cost - kLessCost) || (match.converged && !other.converged)) continue;
        match = std::move(other);
        is_better[s] = 1;
      }
    } catch (const NumericalError&) {
      // no path of least cost: the match stays
    }
  });
  matches.log_evidence = laplace(matches);
  return std::find(is_better.begin(), is_better.end(), 1) != is_better.end();
}

}  // namespace pulson::compare
