#include "compare/forward_samples.hpp"

#include <algorithm>
#include <vector>

#include "matching/momentum_basis.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ForwardSamples draw_shapes(const matching::MatchingProblem& problem, int count, std::uint64_t seed) {
  const SerialBlas serial;
  const matching::MatchingObjective objective(problem);
  const posterior::Specimen specimen(problem);
  const posterior::Specimen::Model model = specimen.model(
      {std::make_shared<KernelOperator>(problem.system.kernel), problem.system.noise, problem.lambda, 1});
  const posterior::ShotBatch shots(specimen, model);
  const Index coordinates = problem.source.size();
  const Index of_noise = objective.unknowns() - objective.basis().unknowns();
  MatrixXd ends(coordinates, count);
  std::vector<char> found(static_cast<std::size_t>(count));
  const Index at_once = shots.at_once();
  parallel_for(static_cast<int>((count + at_once - 1) / at_once), [&](int group) {
    const Index first = group * at_once, some = std::min<Index>(at_once, count - first);
    MatrixXd z(specimen.unknowns(), some);
    for (Index s = 0; s < some; ++s) {
      // Errors of observation first, so that they are the same for all models; then momenta, then the noise.
      const VectorXd normals = standard_normals(seed, static_cast<std::uint64_t>(first + s),
                                                static_cast<int>(2 * coordinates + of_noise), 1);
      const Index of_momenta = objective.basis().unknowns();  // the last ones, as directions fade from the first
      VectorXd unknowns(objective.unknowns());
      unknowns << normals.segment(2 * coordinates - of_momenta, of_momenta), normals.tail(of_noise);
      z.col(s) = specimen.white(model, objective.momenta(unknowns), objective.increments(unknowns));
      ends.col(first + s) = problem.sigma * normals.head(coordinates);
    }
    const posterior::ShotBatch::Ends shot = shots.ends(z);
    ends.middleCols(first, some) += shot.positions;
    std::copy(shot.found.begin(), shot.found.end(), found.begin() + first);
  });
  std::vector<Index> with_path;
  for (Index s = 0; s < count; ++s)
    if (found[static_cast<std::size_t>(s)]) with_path.push_back(s);
  return {ends(Eigen::all, with_path), count};
}

}  // namespace pulson::compare
