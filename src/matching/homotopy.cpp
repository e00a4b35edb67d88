#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/core.h>

#include "model_parameters.hpp"
#include "path_search.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

constexpr int kHalvings = 10;  // three decades
// J has settled where it would grow by less than this part.
constexpr double kSettledGrowth = 1e-2;
// Or by less than this part, and ever less: in the limit the action falls to a quarter as β is halved.
constexpr double kSettling = 1e-1;
constexpr double kFall = 0.5;

RegistrationProblem metamorphosis(const Landmarks& source, const Landmarks& target,
                                  const RegistrationOptions& options) {
  RegistrationProblem problem = make_problem(source, target, options);
  if (problem.mode != MatchingMode::kMetamorphosis)
    throw InputError(
        fmt::format("J(beta) is that of mode metamorphosis, and this is mode {}; take noise such as ch-sd:beta=100%",
                    mode_name(problem.mode)));
  return problem;
}

}  // namespace

double HomotopyStep::growth() const {
  return cost.total() > 0 ? 2 * std::numbers::ln2 * cost.action / cost.total() : 0;
}

void require_homotopy(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options) {
  metamorphosis(source, target, options);
}

std::vector<HomotopyStep> follow_homotopy(const Landmarks& source, const Landmarks& target,
                                          const RegistrationOptions& options, const Registration& registration) {
  const SerialBlas serial;
  const ModelParameters models(metamorphosis(source, target, options), options);
  const std::vector<Eigen::Index> amplitudes = models.places("beta");
  MinimiseOptions how = options.minimise;
  how.seed = options.seed;
  std::vector<HomotopyStep> steps;
  StepFields last;
  for (int k = 0; k <= kHalvings; ++k) {
    Eigen::VectorXd values = models.values();
    for (const Eigen::Index i : amplitudes) values[i] *= std::exp2(-k);
    const RegistrationProblem problem = make_problem(source, target, models.options(values));
    PathSolution found = search_paths(problem.matching, how, k > 0 ? &last : nullptr);
    Registration at = registration;
    at.result = found.path.end();
    steps.push_back(
        {values[amplitudes.front()], found.cost, at.rms(), at.matched(), found.converged, found.iterations});
    last = std::move(found.fields);
    for (Eigen::VectorXd& u : last.controls) u *= 2;  // half the noise, the same velocities
  }
  return steps;
}

std::vector<HomotopyStep>::const_iterator least_needed(const std::vector<HomotopyStep>& steps) {
  const auto unmatched = std::find_if_not(steps.begin(), steps.end(), [](const HomotopyStep& s) { return s.matched; });
  return unmatched == steps.begin() ? steps.end() : std::prev(unmatched);
}

bool reaches_diffeomorphism(const std::vector<HomotopyStep>& steps) {
  const auto least = least_needed(steps);
  if (least == steps.end() || std::next(least) != steps.end()) return false;
  const bool falls = least != steps.begin() && least->cost.action < kFall * std::prev(least)->cost.action;
  return least->growth() < (falls ? kSettling : kSettledGrowth);
}

}  // namespace pulson::matching
