#include "representatives.hpp"

#include <algorithm>

#include "pulson/matching/data_term.hpp"

namespace pulson::matching {

using Eigen::Index;

std::vector<Index> representatives(const MatchingProblem& problem, Index count) {
  const Points& q = problem.source;
  // Squared, to those chosen; below 0 where nothing is observed.
  Eigen::VectorXd distance = (q.colwise() - q.col(0)).colwise().squaredNorm();
  for (Index a = 0; a < q.cols(); ++a)
    if (problem.data->landmarks()->precision(a).isZero(0)) distance[a] = -1;
  std::vector<Index> chosen;
  while (std::ssize(chosen) < count) {
    Index next = 0;
    if (distance.maxCoeff(&next) < 0) break;
    chosen.push_back(next);
    const Eigen::VectorXd to_next = (q.colwise() - q.col(next)).colwise().squaredNorm();
    distance = (distance.array() < 0).select(distance, distance.cwiseMin(to_next));
    distance[next] = -1;
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

bool can_be_subsampled(const MatchingProblem& problem) {
  if (problem.data->landmarks() == nullptr) return false;
  const auto d = static_cast<int>(problem.source.rows()), n = static_cast<int>(problem.source.cols());
  const NoiseModel& noise = *problem.system.noise;
  return noise.channels(d, n) == 0 || (noise.traits().additive && noise.channels(d, n) == d * n);
}

}  // namespace pulson::matching
