#include "evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/undefined.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostIterations = 1000;
constexpr double kSettled = 1e-10;
// Draws of the reference: as many as take about an eighth of the chains' time, an adjoint being worth a path.
constexpr int kMostReference = 50000, kFewestReference = 100;
constexpr int kPathsForOne = 8;
constexpr double kFewestShared = 4;  // draws of the one law that come to where those of the other are

// Variance of numbers of mean 0.
double variance_about_0(const VectorXd& x) { return x.squaredNorm() / static_cast<double>(x.size() - 1); }

double effective(const Effective& size, const VectorXd& values) {
  const double count = size(values);
  return count > 1 ? count : static_cast<double>(values.size());
}

// The logarithm of the ratio of two normalising constants, and how each draw moves it, of mean 0.
struct Bridge {
  double log_ratio = 0;
  VectorXd of_upper, of_lower;
};

// With l = w/e^shift and estimate r: the mean over the lower law of l/(s₁l + s₂r) over that over the upper law of
// 1/(s₁l + s₂r). −∞, where there is no path, is l = 0.
Bridge bridge_between(const VectorXd& upper, const VectorXd& lower, const ArrayXd& parts, double n1, double n2) {
  const double shift = upper.mean();
  const ArrayXd l1 = (upper.array() - shift).exp(), l2 = (lower.array() - shift).exp();
  const double s1 = n1 / (n1 + n2), s2 = n2 / (n1 + n2);
  double r = 1;
  for (int i = 0; i < kMostIterations; ++i) {
    const double next = (parts * l2 / (s1 * l2 + s2 * r)).mean() / (1 / (s1 * l1 + s2 * r)).mean();
    const bool settled = std::abs(next - r) <= kSettled * r;
    r = next;
    if (settled) break;
  }
  const ArrayXd f2 = parts * (l2 / r) / (s1 * l2 / r + s2);
  const ArrayXd f1 = 1 / (s1 * l1 / r + s2);
  return {shift + std::log(r), 1 - f1 / f1.mean(), f2 / f2.mean() - 1};
}

}  // namespace

Estimate bridge(const VectorXd& posterior, const VectorXd& reference, const VectorXd& parts, const Effective& size) {
  const Bridge found =
      bridge_between(posterior, reference, parts, effective(size, posterior), static_cast<double>(reference.size()));
  const double of_lower = variance_about_0(found.of_lower) / static_cast<double>(reference.size());
  const double of_upper = variance_about_0(found.of_upper) / effective(size, found.of_upper);
  if (!(max_or_undefined(of_lower, of_upper) < 1 / kFewestShared)) return {kUndefined, kUndefined};
  return {found.log_ratio, std::sqrt(of_lower + of_upper)};
}

Estimate tempered_log_evidence(const PosteriorDraws& draws) {
  const Effective size = [&](const VectorXd& values) {
    return effective_sample_size(draws.by_chain(values.transpose()));
  };
  const Index levels = draws.tempered_log_likelihood.rows();
  // Of draws of the lowest power only those with a path were kept.
  const double reached = 1 - draws.lost_fraction;
  double sum = std::log(reached);
  const double square = (1 - reached) / reached / static_cast<double>(draws.log_weight.size());
  // Draws of one iteration have exchanged points, so what they move the sum by counts as one.
  VectorXd influence = VectorXd::Zero(draws.log_weight.size());
  for (Index l = 0; l + 1 < levels; ++l) {
    const double step = draws.powers[static_cast<std::size_t>(l + 1)] - draws.powers[static_cast<std::size_t>(l)];
    const VectorXd upper = step * draws.tempered_log_likelihood.row(l + 1).transpose();
    const VectorXd lower = step * draws.tempered_log_likelihood.row(l).transpose();
    const Bridge found =
        bridge_between(upper, lower, ArrayXd::Ones(lower.size()), effective(size, upper), effective(size, lower));
    sum += found.log_ratio;
    influence += found.of_lower + found.of_upper;
  }
  return {sum, std::sqrt(square + variance_about_0(influence) / effective(size, influence))};
}

BridgedEvidence bridge_log_evidence(const ChainSetting& setting, const PosteriorDraws& draws) {
  const Effective size = [&](const VectorXd& values) {
    return effective_sample_size(draws.by_chain(values.transpose()));
  };
  const std::int64_t worth = draws.path_evaluations * (setting.move.uses_gradient ? 2 : 1);
  const auto count = static_cast<int>(std::clamp<std::int64_t>(worth / kPathsForOne, kFewestReference, kMostReference));
  VectorXd reference(count), parts(count);
  parallel_for((count + kBlockOfDraws - 1) / kBlockOfDraws, [&](int block) {
    const Index first = Index{block} * kBlockOfDraws, some = std::min<Index>(kBlockOfDraws, count - first);
    const ReferenceDraws drawn = reference_draws(setting, static_cast<std::uint64_t>(first), some);
    reference.segment(first, some) = drawn.log_weights;
    parts.segment(first, some) = drawn.log_parts.array().exp();
  });
  if (!(reference.maxCoeff() > -std::numeric_limits<double>::infinity()))
    return {{kUndefined, kUndefined}, kUndefined, kUndefined};
  const double of_chains = pareto_k(draws.log_weight);
  return {bridge(draws.log_weight, reference, parts, size), pareto_k(reference + parts.array().log().matrix()),
          of_chains / (1 + std::abs(of_chains))};
}

}  // namespace pulson::inference
