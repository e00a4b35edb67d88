#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "global_search.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"
#include "registration_problem.hpp"

namespace pulson::matching {
namespace {

constexpr int kHalvings = 10;  // three decades
// J has settled where it would grow by less than this part.
constexpr double kSettledGrowth = 1e-2;
// Or by less than this part, and ever less: in the limit the action falls to a quarter as β is halved.
constexpr double kSettling = 1e-1;
constexpr double kFall = 0.5;
constexpr double kSameMinimum = 1e-6;  // costs

// The places of the amplitudes among the numbers of the noise.
std::vector<Eigen::Index> places_of_amplitudes(const MatchingProblem& problem) {
  std::vector<Eigen::Index> places;
  const auto d = static_cast<int>(problem.source.rows()), n = static_cast<int>(problem.source.cols());
  for (const NoiseAmplitude& amplitude : problem.system.noise->amplitudes(d, n)) places.push_back(amplitude.parameter);
  return places;
}

RegistrationProblem metamorphosis(const Landmarks& source, const Landmarks& target,
                                  const RegistrationOptions& options) {
  RegistrationProblem problem = make_problem(source, target, options);
  if (problem.mode != MatchingMode::kMetamorphosis)
    throw InputError(
        fmt::format("J(beta) is that of mode metamorphosis, and this is mode {}; take noise such as ch-sd:beta=100%",
                    mode_name(problem.mode)));
  if (places_of_amplitudes(problem.matching).empty())
    throw InputError(
        fmt::format("J(beta) needs noise of which a number is declared as the amplitude; that of '{}' is not",
                    problem.matching.system.noise->spec()));
  return problem;
}

// The best path that is known at one β, and whether a neighbour has tried it.
struct Level {
  double beta = 0;
  MatchingProblem problem;
  PathSolution best;
  bool tried_below = false, tried_above = false;
};

// From the path at another β. @return whether that is better
bool try_path(const Level& from, Level& to, const MinimiseOptions& how) {
  std::optional<PathSolution> found = search_along(to.problem, how, from.best.path.nodes);
  if (!found) return false;
  found->iterations += to.best.iterations;
  if (!(found->cost.total() < (1 - kSameMinimum) * to.best.cost.total())) {
    to.best.iterations = found->iterations;
    return false;
  }
  to.best = std::move(*found);
  to.tried_below = to.tried_above = false;
  return true;
}

// Branches of minima cross as β changes, so each is followed down and up. A path at some β costs no more at a larger
// one: the envelope never rises with β.
void keep_the_least(std::vector<Level>& levels, const MinimiseOptions& how) {
  for (bool any = true; any && !how.is_interrupted();) {
    any = false;
    for (std::size_t k = 1; k < levels.size(); ++k)
      if (!std::exchange(levels[k - 1].tried_below, true)) any |= try_path(levels[k - 1], levels[k], how);
    for (std::size_t k = levels.size() - 1; k > 0; --k)
      if (!std::exchange(levels[k].tried_above, true)) any |= try_path(levels[k], levels[k - 1], how);
  }
}

}  // namespace

double HomotopyStep::growth() const {
  return cost.total() > 0 ? 2 * std::numbers::ln2 * cost.action / cost.total() : 0;
}

void require_homotopy(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options) {
  if (options.loss) throw InputError("a robust loss and J(beta) do not go together");
  metamorphosis(source, target, options);
}

std::vector<HomotopyStep> follow_homotopy(const Landmarks& source, const Landmarks& target,
                                          const RegistrationOptions& options, const Registration& registration) {
  const SerialBlas serial;
  const MatchingProblem problem = metamorphosis(source, target, options).matching;
  const std::vector<Eigen::Index> amplitudes = places_of_amplitudes(problem);
  MinimiseOptions how = options.minimise;
  how.seed = options.seed;
  std::vector<Level> levels;
  for (int k = 0; k <= kHalvings; ++k) {
    Eigen::VectorXd numbers = problem.system.noise->parameters();
    for (const Eigen::Index i : amplitudes) numbers[i] *= std::exp2(-k);
    MatchingProblem at = problem;
    at.system.noise = problem.system.noise->with_parameters(numbers);
    PathSolution found = search_globally(at, how);
    levels.push_back({numbers[amplitudes.front()], std::move(at), std::move(found)});
  }
  keep_the_least(levels, how);
  std::vector<HomotopyStep> steps;
  for (const Level& level : levels) {
    const PathSolution& best = level.best;
    Registration at = registration;
    at.result = best.path.end();
    steps.push_back(
        {level.beta, best.cost, at.rms(), at.matched(), best.converged, best.iterations, at.unmatched_landmarks()});
  }
  return steps;
}

std::vector<HomotopyStep>::const_iterator least_needed(const std::vector<HomotopyStep>& steps) {
  const auto unmatched = std::find_if_not(steps.begin(), steps.end(), [](const HomotopyStep& s) { return s.matched; });
  return unmatched == steps.begin() ? steps.end() : std::prev(unmatched);
}

std::vector<int> impossible_landmarks(const Points& source, const Points& target) {
  const auto keeps_order = [&](Eigen::Index a, Eigen::Index b) {
    const Eigen::VectorXd before = source.col(b) - source.col(a), after = target.col(b) - target.col(a);
    if (!before.allFinite() || !after.allFinite()) return true;
    return before.isZero(0) == after.isZero(0) && (source.rows() > 1 || before[0] * after[0] >= 0);
  };
  std::vector<int> found;
  for (int a = 0; a < source.cols(); ++a) {
    Eigen::Index b = 0;
    while (b < source.cols() && keeps_order(a, b)) ++b;
    if (b < source.cols()) found.push_back(a);
  }
  return found;
}

bool reaches_diffeomorphism(const std::vector<HomotopyStep>& steps) {
  const auto least = least_needed(steps);
  if (least == steps.end() || std::next(least) != steps.end()) return false;
  const bool falls = least != steps.begin() && least->cost.action < kFall * std::prev(least)->cost.action;
  return least->growth() < (falls ? kSettling : kSettledGrowth);
}

}  // namespace pulson::matching
