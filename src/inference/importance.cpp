#include "importance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>

#include "core/undefined.hpp"
#include "gaussian_mixture.hpp"
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

double effective_count(const ArrayXd& weights) {
  return weights.square().sum() > 0 ? std::pow(weights.sum(), 2) / weights.square().sum() : 0;
}

// Weighted draws: logarithms of weights, and a column of numbers each.
struct Weighted {
  VectorXd log_weights;
  MatrixXd numbers;
};

// Momenta and positions of each draw. @param made its numbers stay 0 without a path
void put_numbers(const Specimen& specimen, const Specimen::Model& model, const MatrixXd& z,
                 const posterior::ShotBatch::Ends& ends, Weighted& made) {
  const Index momenta = specimen.momentum_unknowns(), positions = ends.positions.rows();
  made.numbers = MatrixXd::Zero(momenta + 2 * positions, z.cols());
  for (Index i = 0; i < z.cols(); ++i) {
    if (!(made.log_weights[i] > kImpossible)) continue;
    if (momenta > 0) made.numbers.col(i).head(momenta) = specimen.momenta(model, z.col(i)).reshaped();
    made.numbers.col(i).tail(2 * positions) << ends.positions.col(i), ends.middles.col(i);
  }
}

// So many draws of the reference of a specimen at one θ.
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
  Weighted made{draws.log_weights, {}};
  put_numbers(specimen, theta.models[s], draws.z, draws.ends, made);
  for (Index i = 0; i < count; ++i) {
    const auto component = static_cast<Index>(draws.components[static_cast<std::size_t>(i)]);
    made.log_weights[i] += log_weights[component] - often[component];
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

// Posteriors of few data, without a reference: from draws of the prior on, mixtures are fitted to the posteriors of one
// power of the likelihood after the other, in the directions that the data depend on; in the others draws are the
// prior's.
class AdaptedDraws {
 public:
  /// @param most draws of all stages
  AdaptedDraws(const ChainSetting& setting, std::size_t s, const ThetaPoint& theta, std::int64_t most)
      : setting_(setting),
        s_(s),
        specimen_(setting.specimens[s]),
        model_(theta.models[s]),
        shots_(specimen_, model_),
        blocks_(static_cast<int>(std::clamp<std::int64_t>(most / kUsualStages, kFewestOfStage, kMostOfStage)) /
                kBlockOfDraws),
        stages_(static_cast<int>(std::min<std::int64_t>(kMostStages, most / (blocks_ * kBlockOfDraws)))) {}

  /// @return whether the last mixture is one of the posterior
  bool adapt() {
    if (specimen_.data() > kFewData || specimen_.unknowns() > kMostUnknowns || stages_ < kUsualStages) return false;
    double power = 0;
    int settled = 0;
    for (int stage = 0; stage < stages_; ++stage) {
      const Stage draws = draw_stage(stage);
      if (power == 1 && ++settled >= kSettled &&
          effective_count(draws.weights(1)) >= kManyOfStage * static_cast<double>(draws.of_prior.size()))
        return true;
      power = std::max(power, next_power(draws));
      const ArrayXd weights = draws.weights(power);
      if (weights.sum() == 0) return false;  // no draw has a path
      fit(draws.z, weights, power);
    }
    return power == 1;
  }

  Weighted operator()(std::uint64_t number) const {
    const auto [z, of_prior] = draw(kMostStages, number);
    const auto ends = shots_.ends(z);
    Weighted made{shots_.log_likelihoods(ends) + of_prior, {}};
    for (double& log_weight : made.log_weights)
      if (std::isnan(log_weight)) log_weight = kImpossible;
    put_numbers(specimen_, model_, z, ends, made);
    return made;
  }

 private:
  static constexpr Index kMostUnknowns = 400, kMostDirections = 40;
  static constexpr int kUsualStages = 12, kMostStages = 30, kSettled = 3;
  static constexpr std::int64_t kFewestOfStage = 4096, kMostOfStage = 16384;
  // Effective draws, of all of a stage: those of the next power, and those at which a mixture is good enough.
  static constexpr double kEffectiveOfStage = 0.03, kManyOfStage = 0.1;
  static constexpr Index kSlopes = 32;     // of draws of a stage
  static constexpr double kUnseen = 0.05;  // of |Jz|² in the other directions, in units of σ²
  static constexpr std::uint64_t kAdaptation = 3ULL << 21U;

  struct Draws {
    MatrixXd z;
    VectorXd of_prior;  // log N(z; 0, I) less the logarithm of the proposal
  };

  struct Stage : Draws {
    VectorXd log_likelihoods;

    // With a power of the likelihood; the greatest is 1.
    ArrayXd weights(double power) const {
      const ArrayXd logs =
          (log_likelihoods.array() > kImpossible).select((of_prior + power * log_likelihoods).array(), kImpossible);
      const double largest = logs.maxCoeff();
      if (!(largest > kImpossible)) return ArrayXd::Zero(logs.size());
      return (logs - largest).exp();
    }
  };

  // A block of the proposal.
  Draws draw(int stage, std::uint64_t block) const {
    constexpr std::uint64_t kBlocksOfStage = 1ULL << 19U;
    const std::uint64_t number = static_cast<std::uint64_t>(stage) * kBlocksOfStage + block;
    const Index unknowns = specimen_.unknowns();
    const VectorXd normals =
        drawn(setting_.seed, kAdaptation, number, s_, (unknowns + 1) * static_cast<Index>(kBlockOfDraws));
    const auto table = normals.reshaped(unknowns + 1, kBlockOfDraws);
    Draws draws{table.bottomRows(unknowns), VectorXd::Zero(kBlockOfDraws)};
    if (!mixture_) return draws;
    VectorXd uniforms(kBlockOfDraws);
    for (Index i = 0; i < kBlockOfDraws; ++i) uniforms[i] = normal_probability(table(0, i));
    const MatrixXd before = directions_.transpose() * draws.z, after = mixture_->draw(uniforms, before);
    draws.z += directions_ * (after - before);
    draws.of_prior = -mixture_->log_densities(after);
    return draws;
  }

  Stage draw_stage(int stage) const {
    const Index count = static_cast<Index>(blocks_) * kBlockOfDraws;
    Stage made{{MatrixXd(specimen_.unknowns(), count), VectorXd(count)}, VectorXd(count)};
    parallel_for(blocks_, [&](int block) {
      const Index first = static_cast<Index>(block) * kBlockOfDraws;
      const Draws draws = draw(stage, static_cast<std::uint64_t>(block));
      VectorXd logs = shots_.log_likelihoods(shots_.ends(draws.z));
      for (double& log : logs)
        if (std::isnan(log)) log = kImpossible;
      made.log_likelihoods.segment(first, kBlockOfDraws) = logs;
      made.of_prior.segment(first, kBlockOfDraws) = draws.of_prior;
      made.z.middleCols(first, kBlockOfDraws) = draws.z;
    });
    return made;
  }

  // The greatest power of which enough draws are effective.
  static double next_power(const Stage& draws) {
    constexpr int kHalvingsOfPower = 30;
    const double wanted = kEffectiveOfStage * static_cast<double>(draws.of_prior.size());
    if (effective_count(draws.weights(1)) >= wanted) return 1;
    double low = 0, high = 1;
    for (int halving = 0; halving < kHalvingsOfPower; ++halving) {
      const double middle = 0.5 * (low + high);
      (effective_count(draws.weights(middle)) >= wanted ? low : high) = middle;
    }
    return low;
  }

  void fit(const MatrixXd& z, const ArrayXd& weights, double power) {
    constexpr double kNoWeight = 1e-9;  // of the greatest
    std::vector<Index> some;
    for (Index i = 0; i < weights.size(); ++i)
      if (weights[i] > kNoWeight) some.push_back(i);
    const ArrayXd of_some = weights(some) / weights(some).sum();
    const MatrixXd there = z(Eigen::all, some);
    directions_ = seen_directions(there, of_some, power);
    mixture_.emplace(directions_.transpose() * there, of_some);
  }

  // Orthonormal directions of the unknowns in which the data move, by the slopes at some of the points.
  MatrixXd seen_directions(const MatrixXd& z, const ArrayXd& weights, double power) const {
    const Index unknowns = z.rows();
    std::vector<Index> chosen;
    double below = 0;
    for (Index i = 0; i < z.cols(); ++i) {
      below += weights[i];
      while (std::ssize(chosen) < kSlopes && below >= (static_cast<double>(chosen.size()) + 0.5) / kSlopes)
        chosen.push_back(i);
    }
    MatrixXd gram = MatrixXd::Zero(unknowns, unknowns);
    for (const Index i : chosen) {
      const auto shot = specimen_.shoot(model_, z.col(i));
      if (!shot) continue;
      const LinearModel linear(specimen_, model_, *shot, z.col(i));
      const LinearAt here(linear, model_);
      MatrixXd rows(unknowns, specimen_.data());
      for (Index datum = 0; datum < rows.cols(); ++datum)
        rows.col(datum) = here.transposed(VectorXd::Unit(rows.cols(), datum));
      gram.selfadjointView<Eigen::Lower>().rankUpdate(rows, power / static_cast<double>(chosen.size()));
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram);
    Index count = 0;
    double unseen = gram.trace();
    for (; count < std::min(kMostDirections, unknowns) && (count == 0 || unseen > kUnseen); ++count)
      unseen -= eigen.eigenvalues()[unknowns - 1 - count];
    return eigen.eigenvectors().rightCols(count);
  }

  const ChainSetting& setting_;
  std::size_t s_;
  const Specimen& specimen_;
  const Specimen::Model& model_;
  posterior::ShotBatch shots_;
  int blocks_, stages_;
  MatrixXd directions_;                     // a column each
  std::optional<GaussianMixture> mixture_;  // of these; none: the prior
};

// Paths that cost as much as those of the chains, which are not shot in lanes, or some seconds.
std::int64_t most_adapted(const Specimen& specimen, Index at_once, std::int64_t most) {
  constexpr std::int64_t kFewestSteps = 1 << 21;  // of a landmark, of 0.1 to 1 µs each
  std::int64_t steps = 0;
  for (const auto& branch : specimen.branches()) steps += branch.grid.steps;
  return std::max(most * at_once, kFewestSteps / (steps * specimen.problem().source.cols()));
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
    for (std::size_t s = 0; s < setting.specimens.size(); ++s) {
      const Index numbers = numbers_of(setting.specimens[s]);
      const std::int64_t half =
          most_adapted(setting.specimens[s], posterior::ShotBatch(setting.specimens[s], theta.models[s]).at_once(),
                       most) /
          2;
      AdaptedDraws adapted(setting, s, theta, half);
      if (adapted.adapt())
        add(collect(kBlockOfDraws, numbers, half, each, adapted), estimate);
      else
        add(collect(kBlockOfDraws, numbers, most, each,
                    [&](std::uint64_t number) { return draws_at(setting, s, theta, number, kBlockOfDraws); }),
            estimate);
    }
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
