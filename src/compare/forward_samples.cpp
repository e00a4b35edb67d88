#include "compare/forward_samples.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::VectorXd;

ForwardSamples draw_shapes(const matching::MatchingProblem& problem, int count, std::uint64_t seed) {
  const SerialBlas serial;
  const matching::MatchingObjective objective(problem);
  const Index coordinates = problem.source.size();
  const Index of_noise = objective.unknowns() - objective.basis().unknowns();
  std::vector<std::optional<VectorXd>> ends(static_cast<std::size_t>(count));
  parallel_for(count, [&](int s) {
    // Errors of observation first, so that they are the same for all models; then momenta, then the noise.
    const VectorXd normals =
        standard_normals(seed, static_cast<std::uint64_t>(s), static_cast<int>(2 * coordinates + of_noise), 1);
    const Index of_momenta = objective.basis().unknowns();  // the last ones, as directions fade from the first
    VectorXd z(objective.unknowns());
    z << normals.segment(2 * coordinates - of_momenta, of_momenta), normals.tail(of_noise);
    try {
      const Trajectory path = problem.integrator->integrate(problem.system, {problem.source, objective.momenta(z)},
                                                            problem.grid, objective.increments(z));
      ends[static_cast<std::size_t>(s)] =
          VectorXd(path.final().q.reshaped() + problem.sigma * normals.head(coordinates));
    } catch (const StepError&) {
      // counted below: there are fewer ends than were drawn
    }
  });
  ForwardSamples samples{Eigen::MatrixXd(coordinates, count), count};
  Index next = 0;
  for (const auto& end : ends)
    if (end) samples.ends.col(next++) = *end;
  samples.ends.conservativeResize(Eigen::NoChange, next);
  return samples;
}

}  // namespace pulson::compare
