#include "importance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/diagnostics.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kImportanceChains = 1ULL << 21U;
constexpr Index kAtOneTheta = 8;         // draws of a specimen, as many as the widest vectors have lanes
constexpr Index kFirst = 4096;           // draws after which it is known whether more are of use
constexpr double kOfUse = 40;            // effective draws of the first: a hundredth of them
constexpr Index kMostNumbers = 1 << 22;  // kept, of all draws

// Weighted draws: logarithms of weights, and a column of numbers each.
struct Weighted {
  VectorXd log_weights;
  MatrixXd numbers;
};

// So many draws of a specimen at one θ.
Weighted draws_at(const ChainSetting& setting, std::size_t s, const ThetaPoint& theta, std::uint64_t number,
                  Index count) {
  const Specimen& specimen = setting.specimens[s];
  const std::size_t kind = 2 * s + 2;
  const VectorXd& log_weights = setting.reference.log_weights[s];
  const VectorXd often = tilted(log_weights, setting.reference.components[s]);
  VectorXd uniforms(count);
  MatrixXd normals(specimen.unknowns() + specimen.data(), count);
  for (Index i = 0; i < count; ++i) {
    const std::uint64_t draw = number * static_cast<std::uint64_t>(kBlockOfDraws) + static_cast<std::uint64_t>(i);
    uniforms[i] = normal_probability(drawn(setting.seed, kImportanceChains, draw, kind, 1)[0]);
    normals.col(i) = drawn(setting.seed, kImportanceChains, draw, kind + 1, normals.rows());
  }
  const SpecimenDraws draws = specimen_draws(setting, s, theta, 1, often, uniforms, normals);
  const Index momenta = specimen.momentum_unknowns(), positions = draws.ends.positions.rows();
  Weighted made{draws.log_weights, MatrixXd::Zero(momenta + 2 * positions, count)};
  for (Index i = 0; i < count; ++i) {
    if (!(made.log_weights[i] > kImpossible)) continue;
    const auto component = static_cast<Index>(draws.components[static_cast<std::size_t>(i)]);
    made.log_weights[i] += log_weights[component] - often[component];
    if (momenta > 0) made.numbers.col(i).head(momenta) = specimen.momenta(theta.models[s], draws.z.col(i)).reshaped();
    made.numbers.col(i).tail(2 * positions) << draws.ends.positions.col(i), draws.ends.middles.col(i);
  }
  return made;
}

// The mean weight and the weighted means of numbers.
struct Mean {
  double log_weight = kImpossible;
  VectorXd numbers;
};
Mean mean_of(const Weighted& draws) {
  const double largest = draws.log_weights.maxCoeff();
  if (!(largest > kImpossible)) return {kImpossible, VectorXd::Zero(draws.numbers.rows())};
  const VectorXd weights = (draws.log_weights.array() - largest).exp();
  return {largest + std::log(weights.mean()), draws.numbers * weights / weights.sum()};
}

// A draw of θ with some of each specimen.
Mean joint_draw(const ChainSetting& setting, std::uint64_t number, Index numbers) {
  const Index k = setting.space.count();
  Mean joint{0, VectorXd::Zero(numbers)};
  try {
    const std::uint64_t draw = number * static_cast<std::uint64_t>(kBlockOfDraws);
    const VectorXd phi =
        setting.reference.draw(drawn(setting.seed, kImportanceChains, draw, 0, k),
                               normal_probability(drawn(setting.seed, kImportanceChains, draw, 1, 1)[0]));
    const ThetaPoint theta = make_theta(setting, phi, 1);
    joint.log_weight = log_standard_normal(phi) - setting.reference.log_density(phi);
    joint.numbers.head(k) = phi;
    Index row = k;
    for (std::size_t s = 0; s < setting.specimens.size(); ++s) {
      const Mean mean = mean_of(draws_at(setting, s, theta, number, kAtOneTheta));
      joint.log_weight += mean.log_weight;
      joint.numbers.segment(row, mean.numbers.size()) = mean.numbers;
      row += mean.numbers.size();
    }
  } catch (const Error&) {
    joint.log_weight = kImpossible;  // θ without a model
  }
  return joint;
}

double effective_count(const ArrayXd& weights) {
  return weights.square().sum() > 0 ? std::pow(weights.sum(), 2) / weights.square().sum() : 0;
}

// The estimates of one set of draws, joined to what others gave.
void add(const Weighted& draws, ImportanceEstimate& to) {
  const auto count = static_cast<double>(draws.log_weights.size());
  const double largest = draws.log_weights.maxCoeff();
  if (!(largest > kImpossible)) {
    to.effective = 0;
    to.pareto_k = kUndefined;
    return;
  }
  const ArrayXd weights = (draws.log_weights.array() - largest).exp();
  const double sum = weights.sum(), effective = effective_count(weights);
  to.effective = std::min(to.effective, effective);
  to.pareto_k = max_or_undefined(to.pareto_k, pareto_k(draws.log_weights));
  to.log_evidence.value += largest + std::log(sum / count);
  to.log_evidence.standard_error =
      std::hypot(to.log_evidence.standard_error, std::sqrt(std::max(0.0, 1 / effective - 1 / count)));
  for (Index i = 0; i < draws.numbers.rows(); ++i) {
    const double mean = (draws.numbers.row(i).transpose().array() * weights).sum() / sum;
    const double square = (weights * (draws.numbers.row(i).transpose().array() - mean)).square().sum();
    to.numbers.push_back({mean, std::sqrt(square) / sum});
  }
}

// Draws in order, more of them where the first show that they are of use. @param make the draws of one number
template <class Make>
Weighted collect(Index each, Index numbers, std::int64_t most, double accuracy, const Make& make) {
  Weighted all{VectorXd(0), MatrixXd(numbers, 0)};
  const auto extend = [&](Index to) {
    const Index from = all.log_weights.size(), first = from / each, last = to / each;
    all.log_weights.conservativeResize(last * each);
    all.numbers.conservativeResize(Eigen::NoChange, last * each);
    parallel_for(static_cast<int>(last - first), [&](int i) {
      const Index number = first + i;
      const Weighted some = make(static_cast<std::uint64_t>(number));
      all.log_weights.segment(number * each, each) = some.log_weights;
      all.numbers.middleCols(number * each, each) = some.numbers;
    });
  };
  const Index largest = std::min<Index>(most, kMostNumbers / std::max<Index>(numbers, 1));
  extend(std::max(each, std::min(kFirst, largest)));
  const ArrayXd weights = (all.log_weights.array() - all.log_weights.maxCoeff()).exp();
  const double effective = effective_count(weights);
  if (!(effective >= kOfUse * static_cast<double>(weights.size()) / static_cast<double>(kFirst))) return all;
  const double needed = static_cast<double>(weights.size()) / effective / (accuracy * accuracy);
  if (needed > static_cast<double>(weights.size()))
    extend(static_cast<Index>(std::min(needed, static_cast<double>(largest))));
  return all;
}

}  // namespace

ImportanceEstimate importance_estimate(const ChainSetting& setting, std::int64_t most, double accuracy) {
  const Index k = setting.space.count();
  ImportanceEstimate estimate;
  estimate.effective = std::numeric_limits<double>::infinity();
  const auto numbers_of = [&](const Specimen& specimen) {
    return specimen.momentum_unknowns() + 2 * specimen.problem().source.size() * std::ssize(specimen.branches());
  };
  if (k == 0) {
    const ThetaPoint theta = make_theta(setting, setting.reference.centre, 1);
    const double each = accuracy / std::sqrt(static_cast<double>(setting.specimens.size()));
    for (std::size_t s = 0; s < setting.specimens.size(); ++s)
      add(collect(kBlockOfDraws, numbers_of(setting.specimens[s]), most, each,
                  [&](std::uint64_t number) { return draws_at(setting, s, theta, number, kBlockOfDraws); }),
          estimate);
    return estimate;
  }
  Index numbers = k;
  for (const Specimen& specimen : setting.specimens) numbers += numbers_of(specimen);
  add(collect(1, numbers, most / kAtOneTheta, accuracy,
              [&](std::uint64_t number) {
                const Mean joint = joint_draw(setting, number, numbers);
                return Weighted{VectorXd::Constant(1, joint.log_weight), joint.numbers};
              }),
      estimate);
  return estimate;
}

}  // namespace pulson::inference
