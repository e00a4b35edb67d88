// Momenta that are linear in a covariate, means of groups, and random permutations.

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "pulson/cohort/statistics.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

Points mean_momenta(const Atlas& atlas, const std::vector<int>& chosen) {
  Points sum = Points::Zero(atlas.mean.points.rows(), atlas.mean.points.cols());
  for (const int i : chosen) sum += atlas.specimens[static_cast<std::size_t>(i)].momenta;
  return sum / static_cast<double>(chosen.size());
}

}  // namespace

std::vector<int> random_permutation(std::uint64_t seed, std::uint64_t index, int size) {
  const VectorXd keys = standard_normals(seed, index, size, 1);
  std::vector<int> order(static_cast<std::size_t>(size));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return keys[a] < keys[b]; });
  return order;
}

MomentumRegression regress_momenta(const Atlas& atlas, const VectorXd& covariate) {
  const SerialBlas serial;
  std::vector<int> chosen;
  for (Index i = 0; i < covariate.size(); ++i)
    if (std::isfinite(covariate[i])) chosen.push_back(static_cast<int>(i));
  if (chosen.size() < 3)
    throw InputError(
        fmt::format("{} specimens have a value of the covariate; a regression needs three", chosen.size()));
  MomentumRegression found;
  VectorXd x = covariate(chosen);
  found.mean = x.mean();
  x.array() -= found.mean;
  const double squares = x.squaredNorm();
  if (!(squares > 0)) throw InputError("the covariate has the same value for all specimens");
  found.specimens = static_cast<int>(chosen.size());
  found.intercept = mean_momenta(atlas, chosen);
  found.slope = Points::Zero(found.intercept.rows(), found.intercept.cols());
  for (std::size_t i = 0; i < chosen.size(); ++i)
    found.slope += x[static_cast<Index>(i)] / squares *
                   (atlas.specimens[static_cast<std::size_t>(chosen[i])].momenta - found.intercept);
  return found;
}

std::vector<GroupMean> group_means(const Atlas& atlas, const std::vector<std::string>& groups) {
  std::map<std::string, std::vector<int>> members;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i].empty()) continue;
    std::vector<int>& of_group = members[groups[i]];
    if (of_group.empty()) order.push_back(groups[i]);
    of_group.push_back(static_cast<int>(i));
  }
  std::vector<GroupMean> means;
  for (const std::string& name : order)
    means.push_back({name, static_cast<int>(members[name].size()), mean_momenta(atlas, members[name])});
  return means;
}

}  // namespace pulson::cohort
