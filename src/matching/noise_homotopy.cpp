#include "noise_homotopy.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "noise/models.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

// λβ² from one search to the next; how much further than the tolerance all but the last may end; and the iterations of
// those between the first and the last, which begin near their minimum. (489 markers: J 0.0113 with peakon, 0.00906
// with matern32; 0.0207 and 0.00905 with 1/4, 1000 and 5 iterations, 0.0123 and 0.00904 with 1/16, 100 and 10.)
constexpr double kLevelRatio = 1.0 / 16;
constexpr double kLevelTolerance = 100;
constexpr int kLevelIterations = 20;

}  // namespace

double added_by_noise(const MatchingProblem& problem) {
  const NoiseCometric cometric = noise_cometric(*problem.system.noise, problem.source);
  return problem.lambda * cometric.matrix.diagonal().mean();
}

MatchingProblem with_more_noise(MatchingProblem problem, double more) {
  if (more <= 0) return problem;
  const auto each = make_noise(fmt::format("ch-sd:beta={:.17g}", std::sqrt(more / problem.lambda)));
  const NoiseModel& noise = *problem.system.noise;
  const bool is_noisy =
      noise.channels(static_cast<int>(problem.source.rows()), static_cast<int>(problem.source.cols())) > 0;
  problem.system.noise = is_noisy ? sum_of_noises({problem.system.noise, each}) : each;
  return problem;
}

PathSolution search_from_much_noise(const MatchingProblem& problem, const MinimiseOptions& options, Finish finish) {
  const double own = added_by_noise(problem);
  MinimiseOptions loosely = options;
  loosely.gradient_tolerance *= kLevelTolerance;
  std::vector<Points> nodes(static_cast<std::size_t>(problem.grid.steps) + 1, problem.source);
  int iterations = 0, evaluations = 0;
  const auto search = [&](const MatchingProblem& of, const MinimiseOptions& how, Finish until) {
    std::optional<DiscretePath> path = along({of.system, of.lambda}, of.grid, nodes, nullptr, true);
    if (!path) throw NumericalError("the distances to the target, divided by sigma, leave the range of numbers");
    PathSolution found = continue_path(of, how, std::move(*path), until);
    found.iterations = iterations += found.iterations;
    found.evaluations = evaluations += found.evaluations;
    return found;
  };
  for (double level = problem.system.kernel.at_zero(); level > own && !options.is_interrupted(); level *= kLevelRatio) {
    nodes = search(with_more_noise(problem, level - own), loosely, Finish::kShootable).path.nodes;
    loosely.max_iterations = std::min(options.max_iterations, kLevelIterations);
  }
  return search(problem, options, finish);
}

}  // namespace pulson::matching
