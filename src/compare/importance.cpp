#include "importance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "random/normals.hpp"
#include "shape_draws.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::uint64_t kBeyond = 1U << 20;  // of the streams of random numbers
constexpr double kNone = -std::numeric_limits<double>::infinity();

// Of the weights of draws, a set of signs in each column.
ImportanceEstimate estimate(const Eigen::Ref<const MatrixXd>& log_weights) {
  const double largest = log_weights.maxCoeff();
  const auto samples = static_cast<int>(log_weights.size());
  if (!std::isfinite(largest) || log_weights.hasNaN())
    return {largest, 0, samples, 0, samples, VectorXd::Constant(log_weights.cols(), largest)};
  const Eigen::ArrayXXd weights = (log_weights.array() - largest).exp();
  const Eigen::ArrayXd of_sets = weights.colwise().mean();
  const double mean = of_sets.mean();
  const auto count = static_cast<double>(of_sets.size());
  ImportanceEstimate found;
  found.variance = (of_sets / mean - 1).square().sum() / (count * std::max(1.0, count - 1));
  found.log_evidence = largest + std::log(mean) + 0.5 * found.variance;
  found.samples = samples;
  found.effective_samples = weights.sum() * weights.sum() / weights.square().sum();
  found.log_sets = largest + of_sets.log();
  found.lost = static_cast<int>((log_weights.array() == kNone).count());
  return found;
}

// Where the iteration comes nowhere from the end of an earlier one it begins as if there were none.
VectorXd log_weights_from(const ShapeDraws& draws, const MatrixXd& normals, const std::vector<VectorXd*>& v) {
  std::vector<Index> known;
  for (Index l = 0; l < normals.cols(); ++l)
    if (v[static_cast<std::size_t>(l)]->size() > 0) known.push_back(l);
  VectorXd weights = draws.log_weights(normals, v);
  std::vector<Index> again;
  std::vector<VectorXd*> from_new;
  for (const Index l : known)
    if (weights[l] == kNone) {
      again.push_back(l);
      from_new.push_back(v[static_cast<std::size_t>(l)]);
    }
  if (!again.empty()) weights(again) = draws.log_weights(normals(Eigen::all, again), from_new);
  return weights;
}

}  // namespace

BeyondEstimate sample_beyond(const matching::MatchingObjective& objective, const Observation& observation,
                             const Linearised& match, int samples, std::uint64_t seed) {
  ShapeDraws draws(objective, observation, match);
  draws.find_axes();
  VectorXd weights = VectorXd::Zero(samples);
  for (Index i = 0; i < samples; ++i) {
    const VectorXd normals =
        standard_normals(seed, kBeyond + static_cast<std::uint64_t>(i), static_cast<int>(match.jacobian.cols()), 1);
    if (const auto log_weight = draws.log_weight_beyond(normals, i % 2 == 0))
      weights[i] = std::exp(*log_weight - match.log_evidence);
  }
  const auto count = static_cast<double>(samples);
  const double mean = weights.mean();
  return {mean, (weights.array() - mean).square().sum() / (count * std::max(1.0, count - 1))};
}

ImportanceEstimate importance_sample(const matching::MatchingObjective& objective, const Observation& observation,
                                     const Linearised& match, int samples, double enough, std::uint64_t seed,
                                     std::vector<VectorXd>& begin) {
  constexpr Index kLeastSets = 4;
  const ShapeDraws draws(objective, observation, match);
  const Index of_set = draws.of_one_set();
  const Index sets = (samples + ShapeDraws::kMostOfOneSet - 1) / ShapeDraws::kMostOfOneSet;
  begin.resize(static_cast<std::size_t>(of_set * sets));
  MatrixXd log_weights = MatrixXd::Constant(of_set, sets, kNone);
  const Index at_once = std::max<Index>(1, draws.at_once() / of_set);  // sets
  for (Index i = 0; i < sets; i += at_once) {
    const Index some = std::min(at_once, sets - i);
    MatrixXd normals(draws.normals(), of_set * some);
    std::vector<VectorXd*> places;
    for (Index j = 0; j < some; ++j)
      normals.middleCols(of_set * j, of_set) = draws.with_all_signs(
          standard_normals(seed, static_cast<std::uint64_t>(i + j), static_cast<int>(draws.normals()), 1));
    for (Index j = 0; j < normals.cols(); ++j) places.push_back(&begin[static_cast<std::size_t>(of_set * i + j)]);
    log_weights.middleCols(i, some).reshaped() = log_weights_from(draws, normals, places);
    if (i + some < kLeastSets) continue;
    ImportanceEstimate so_far = estimate(log_weights.leftCols(i + some));
    if (std::isfinite(so_far.log_evidence) && so_far.variance <= enough) return so_far;
  }
  return estimate(log_weights);
}

}  // namespace pulson::compare
