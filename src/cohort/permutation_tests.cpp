// Regression of momenta on a covariate, and the comparison of groups.

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
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kBatch = 64;            // permutations per task
constexpr double kEqual = 1 - 1e-12;  // statistics of equal permutations differ by rounding

// Scores of momenta, n×r: distances between rows are those in the metric of the kernel.
MatrixXd scores_of(const Atlas& atlas, const std::vector<int>& chosen) {
  return momentum_modes(atlas).scores(chosen, Eigen::all);
}

// Part of the permutations, the identity included, whose statistic is no less than that of the identity.
template <class Statistic>
double permutation_p(const Statistic& statistic, int size, const PermutationOptions& options) {
  std::vector<int> identity(static_cast<std::size_t>(size));
  std::iota(identity.begin(), identity.end(), 0);
  const double least = kEqual * statistic(identity);
  const int batches = (options.count + kBatch - 1) / kBatch;
  std::vector<int> as_large(static_cast<std::size_t>(batches));
  parallel_for(batches, [&](int batch) {
    for (int k = batch * kBatch; k < std::min(options.count, (batch + 1) * kBatch); ++k)
      if (statistic(random_permutation(options.seed, static_cast<std::uint64_t>(k), size)) >= least)
        ++as_large[static_cast<std::size_t>(batch)];
  });
  return (1.0 + std::accumulate(as_large.begin(), as_large.end(), 0)) / (1.0 + options.count);
}

void check(const PermutationOptions& options) {
  if (options.count < 1) throw InputError(fmt::format("permutations is {}; it must be at least 1", options.count));
}

MatrixXd centred(MatrixXd rows) {
  rows.rowwise() -= rows.colwise().mean().eval();
  return rows;
}

Points mean_momenta(const Atlas& atlas, const std::vector<int>& chosen) {
  Points sum = Points::Zero(atlas.mean.points.rows(), atlas.mean.points.cols());
  for (const int i : chosen) sum += atlas.specimens[static_cast<std::size_t>(i)].momenta;
  return sum / static_cast<double>(chosen.size());
}

// Σ_g |sum of the rows of group g|²/n_g, the rows being taken in the order of a permutation.
double between_squares(const MatrixXd& rows, const std::vector<int>& group_of, const std::vector<int>& sizes,
                       const std::vector<int>& order) {
  MatrixXd sums = MatrixXd::Zero(std::ssize(sizes), rows.cols());
  for (std::size_t i = 0; i < order.size(); ++i) sums.row(group_of[i]) += rows.row(order[i]);
  double squares = 0;
  for (std::size_t g = 0; g < sizes.size(); ++g) squares += sums.row(static_cast<Index>(g)).squaredNorm() / sizes[g];
  return squares;
}

struct Grouping {
  std::vector<int> specimens;  // that have a group
  std::vector<int> group_of;   // of each of these
};

Grouping group(const std::vector<std::string>& names, GroupComparison& comparison) {
  Grouping grouping;
  std::map<std::string, int> known;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty()) continue;
    const auto [place, is_new] = known.emplace(names[i], static_cast<int>(known.size()));
    if (is_new) {
      comparison.names.push_back(names[i]);
      comparison.sizes.push_back(0);
    }
    ++comparison.sizes[static_cast<std::size_t>(place->second)];
    grouping.specimens.push_back(static_cast<int>(i));
    grouping.group_of.push_back(place->second);
  }
  if (comparison.names.size() < 2)
    throw InputError(fmt::format(
        "there {}; a comparison needs two groups",
        comparison.names.empty() ? std::string("are no groups") : "is one group, '" + comparison.names.front() + "'"));
  if (comparison.names.size() == grouping.specimens.size())
    throw InputError("each specimen is a group of its own; some group needs two");
  return grouping;
}

GroupComparison::Pair compare_pair(const MatrixXd& rows, const std::vector<int>& group_of, int first, int second,
                                   const PermutationOptions& options) {
  std::vector<int> members, places, sizes(2);
  for (std::size_t i = 0; i < group_of.size(); ++i)
    if (group_of[i] == first || group_of[i] == second) {
      members.push_back(static_cast<int>(i));
      places.push_back(group_of[i] == first ? 0 : 1);
      ++sizes[static_cast<std::size_t>(places.back())];
    }
  const MatrixXd chosen = centred(rows(members, Eigen::all));
  const auto statistic = [&](const std::vector<int>& order) { return between_squares(chosen, places, sizes, order); };
  std::vector<int> identity(members.size());
  std::iota(identity.begin(), identity.end(), 0);
  // n₁|m₁|² + n₂|m₂|² = n₁n₂/(n₁ + n₂) |m₁ − m₂|²
  const double distance = std::sqrt(statistic(identity) * (sizes[0] + sizes[1]) / (1.0 * sizes[0] * sizes[1]));
  return {first, second, distance, permutation_p(statistic, static_cast<int>(members.size()), options)};
}

}  // namespace

std::vector<int> random_permutation(std::uint64_t seed, std::uint64_t index, int size) {
  const VectorXd keys = standard_normals(seed, index, size, 1);
  std::vector<int> order(static_cast<std::size_t>(size));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return keys[a] < keys[b]; });
  return order;
}

MomentumRegression regress_momenta(const Atlas& atlas, const VectorXd& covariate, const PermutationOptions& options) {
  const SerialBlas serial;
  check(options);
  std::vector<int> chosen;
  for (Index i = 0; i < covariate.size(); ++i)
    if (std::isfinite(covariate[i])) chosen.push_back(static_cast<int>(i));
  if (chosen.size() < 3)
    throw InputError(
        fmt::format("{} specimens have a value of the covariate; a regression needs three", chosen.size()));
  MomentumRegression found;
  const auto n = static_cast<double>(chosen.size());
  VectorXd x = covariate(chosen);
  found.mean = x.mean();
  x.array() -= found.mean;
  const double squares = x.squaredNorm();
  if (!(squares > 0)) throw InputError("the covariate has the same value for all specimens");
  const MatrixXd rows = centred(scores_of(atlas, chosen));
  const auto statistic = [&](const std::vector<int>& order) {
    return (x.transpose() * rows(order, Eigen::all)).squaredNorm() / squares;
  };
  std::vector<int> identity(chosen.size());
  std::iota(identity.begin(), identity.end(), 0);
  found.r_squared = statistic(identity) / rows.squaredNorm();
  found.f = found.r_squared * (n - 2) / (1 - found.r_squared);
  found.p_value = permutation_p(statistic, static_cast<int>(chosen.size()), options);
  found.permutations = options.count;
  found.specimens = static_cast<int>(chosen.size());
  found.intercept = mean_momenta(atlas, chosen);
  found.slope = Points::Zero(found.intercept.rows(), found.intercept.cols());
  for (std::size_t i = 0; i < chosen.size(); ++i)
    found.slope += x[static_cast<Index>(i)] / squares *
                   (atlas.specimens[static_cast<std::size_t>(chosen[i])].momenta - found.intercept);
  return found;
}

GroupComparison compare_groups(const Atlas& atlas, const std::vector<std::string>& groups,
                               const PermutationOptions& options) {
  const SerialBlas serial;
  check(options);
  GroupComparison found;
  const auto [chosen, group_of] = group(groups, found);
  const MatrixXd rows = centred(scores_of(atlas, chosen));
  const auto statistic = [&group_of = group_of, &rows, &found](const std::vector<int>& order) {
    return between_squares(rows, group_of, found.sizes, order);
  };
  std::vector<int> identity(chosen.size());
  std::iota(identity.begin(), identity.end(), 0);
  const auto n = static_cast<double>(chosen.size()), g = static_cast<double>(found.names.size());
  found.r_squared = statistic(identity) / rows.squaredNorm();
  found.f = found.r_squared * (n - g) / ((1 - found.r_squared) * (g - 1));
  found.p_value = permutation_p(statistic, static_cast<int>(chosen.size()), options);
  found.permutations = options.count;
  for (std::size_t k = 0; k < found.names.size(); ++k) {
    std::vector<int> members;
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (group_of[i] == static_cast<int>(k)) members.push_back(chosen[i]);
    found.means.push_back(mean_momenta(atlas, members));
  }
  for (int second = 1; second < static_cast<int>(found.names.size()); ++second)
    for (int first = 0; first < second; ++first)
      found.pairs.push_back(compare_pair(rows, group_of, first, second, options));
  return found;
}

}  // namespace pulson::cohort
