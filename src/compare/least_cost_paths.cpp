#include "least_cost_paths.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cohort_model.hpp"
#include "matching/global_search.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "statistics.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kFewestSteps = 20;   // of a path: the fit needs no more than its ends need
constexpr double kMatchedRms = 3;  // σ, as the first condition of Registration::matched()

// Where the momenta vanish λ is so large that K + λΣhhᵀ is singular by round-off. It is then one at which they move a
// landmark by this part of σ: for two outlines of 30 points (sample_shapes/cs_*.csv, p-sd) J is 13.79, 13.68 with a
// hundredth of that λ, and with a hundred times as much the search stops at 39.
constexpr double kVanishing = 0.05;

// Nodes of the most probable path of a shape; none where the integrator finds none.
std::vector<Points> path_of(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings, int target) {
  const matching::MatchingProblem problem = shape_problem(cohort, fit, settings, target);
  const ShapeFit& shape = fit.shapes[static_cast<std::size_t>(target)];
  std::vector<Points> nodes;
  try {
    const Trajectory path =
        problem.integrator->integrate(problem.system, {problem.source, shape.momenta}, settings.grid, shape.increments);
    for (const PhaseState& state : path.states) nodes.push_back(state.q);
  } catch (const StepError&) {
    nodes.clear();
  }
  return nodes;
}

// The better of what searches find, and of what is next to a path.
matching::PathSolution least_cost_path(const matching::MatchingProblem& problem, const std::vector<Points>& nodes) {
  matching::PathSolution found = search_globally(problem, {});
  if (nodes.empty()) return found;
  std::optional<matching::PathSolution> near = search_along(problem, {}, nodes);
  if (near && near->cost.total() < found.cost.total()) return std::move(*near);
  return found;
}

}  // namespace

std::optional<LeastCostPaths> least_cost_paths(const Cohort& cohort, const CohortFit& fit,
                                               const CohortSettings& settings) {
  const bool is_linear = shape_problem(cohort, fit, settings, 0).system.noise->traits().linear;
  if (fit.noise != "none" && !is_linear) return std::nullopt;
  const Points& source = cohort.source.points;
  const auto count = std::ssize(cohort.targets);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  VectorXd total = VectorXd::Constant(count, nan);
  VectorXd action = total, rms = total, inversions = total, flipped = total;
  Eigen::Array<bool, Eigen::Dynamic, 1> converged = Eigen::Array<bool, Eigen::Dynamic, 1>::Constant(count, false);
  parallel_for(static_cast<int>(count), [&](int s) {
    matching::MatchingProblem problem = shape_problem(cohort, fit, settings, s);
    problem.grid.steps = std::max(problem.grid.steps, kFewestSteps);
    if (fit.momenta_vanish())
      problem.lambda = std::min(problem.lambda, problem.system.kernel.at_zero() * std::pow(problem.grid.time, 2) /
                                                    std::pow(kVanishing * problem.sigma, 2));
    problem.lambda /= problem.grid.time;  // the energy is λH there, λ∫H dt here
    if (fit.noise_vanishes()) problem.system.noise = make_noise("none");
    try {
      const matching::PathSolution found = least_cost_path(problem, path_of(cohort, fit, settings, s));
      const Points& end = found.path.end();
      const posterior::Specimen specimen(problem, cohort.alignment);
      const double misfit =
          specimen
              .residual(specimen.model({std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise}),
                        end.reshaped())
              .head(specimen.coordinates())
              .norm();
      const Landmarks& shape = cohort.targets[static_cast<std::size_t>(s)];
      const auto landmarks = static_cast<double>(shape.count() - std::ssize(incomplete_points(shape.points)));
      total[s] = found.cost.energy + found.cost.action + 0.5 * misfit * misfit;
      action[s] = found.cost.action;
      rms[s] = problem.sigma * misfit / std::sqrt(std::max(landmarks, 1.0));
      if (source.rows() == 1) inversions[s] = matching::order_inversions(source, end);
      if (source.rows() == 2) flipped[s] = warp::flipped_triangles(source, end);
      converged[s] = found.converged;
    } catch (const NumericalError&) {
      // no path: not matched
    }
  });
  const auto estimate = [](const VectorXd& values) { return Estimate{values.mean(), standard_error(values)}; };
  return LeastCostPaths{.total = estimate(total),
                        .action = estimate(action),
                        .rms = estimate(rms),
                        .order_inversions = estimate(inversions),
                        .flipped_triangles = estimate(flipped),
                        .matched = static_cast<int>((rms.array() <= kMatchedRms * fit.sigma).count()),
                        .converged = static_cast<int>(converged.count())};
}

}  // namespace pulson::compare
