#include "finer_steps.hpp"

#include <algorithm>
#include <cmath>

#include "core/factorisations.hpp"
#include "core/undefined.hpp"
#include "normal_quantile.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kRefinements = 1ULL << 22U;
// Of weighted draws, where it is not known to a quarter of kStepError before; in vector lanes four cost about one path.
constexpr std::int64_t kFirstDraws = 1000, kMoreDraws = 4;
constexpr std::int64_t kMostDraws = 8000, kMostLaneDraws = 64000;
constexpr int kMostSteps = 128;
// Of so few the error of a mean is itself not known to an eighth, 1/√60; of one that outweighs all others it would be
// 0.
constexpr double kFewEffective = 30;
// Of the difference between steps and twice as many, the distance from the limit of fine steps and the next difference:
// of a scheme of order 2, Σ 4⁻ʲ, as that of noise that is additive, and of order 1, Σ 2⁻ʲ.
struct Order {
  double to_limit = 4.0 / 3, next = 0.25;
};
constexpr Order kOfAdditive{}, kOfOthers{2, 0.5};

struct Change {
  Estimate estimate{kUndefined, kUndefined};
  double effective = 0;  ///< draws, the fewer of both
};

Change of_specimen(const ChainSetting& setting, const ThetaPoint& theta, std::size_t s, const Specimen& finer,
                   std::int64_t draws) {
  const Specimen& specimen = setting.specimens[s];
  const Specimen::Model model = finer.model(setting.space.at(setting.reference.centre));
  const VectorXd& log_weights = setting.reference.log_weights[s];
  const VectorXd often = tilted(log_weights, setting.reference.components[s]);
  const posterior::ShotBatch with_these(specimen, theta.models[s]), with_finer(finer, model);
  VectorXd coarse(draws), fine(draws);
  parallel_for(static_cast<int>((draws + kBlockOfDraws - 1) / kBlockOfDraws), [&](int block) {
    const Index first = block * kBlockOfDraws, count = std::min<Index>(kBlockOfDraws, draws - first);
    MatrixXd z(specimen.unknowns(), count), halved(finer.unknowns(), count);
    VectorXd of_prior(count);
    for (Index i = 0; i < count; ++i) {
      const auto number = static_cast<std::uint64_t>(first + i);
      const std::size_t kind = 3 * s;
      const std::size_t component =
          drawn_component(often, normal_probability(drawn(setting.seed, kRefinements, number, kind, 1)[0]));
      z.col(i) = theta.linear[s][component].draw(
          drawn(setting.seed, kRefinements, number, kind + 1, specimen.unknowns() + specimen.data()));
      of_prior[i] = log_weights[static_cast<Index>(component)] - often[static_cast<Index>(component)] -
                    log_mixture_of(setting, s, theta, 1, z.col(i)).value;
      halved.col(i) = posterior::refined(specimen, z.col(i),
                                         drawn(setting.seed, kRefinements, number, kind + 2, specimen.unknowns()));
    }
    coarse.segment(first, count) = of_prior + with_these.log_likelihoods(with_these.ends(z));
    fine.segment(first, count) = of_prior + with_finer.log_likelihoods(with_finer.ends(halved));
  });
  const double largest = coarse.maxCoeff();
  if (!(largest > kImpossible) || !(fine.maxCoeff() > kImpossible)) return {};
  const ArrayXd of_coarse = (coarse.array() - largest).exp(), of_fine = (fine.array() - largest).exp();
  const auto effective = [](const ArrayXd& weights) { return std::pow(weights.sum(), 2) / weights.square().sum(); };
  const double fewer = std::min(effective(of_coarse), effective(of_fine));
  if (!(fewer >= kFewEffective)) return {.effective = fewer};
  const double difference = std::log(of_fine.mean() / of_coarse.mean());
  const ArrayXd influence = of_fine / of_fine.mean() - of_coarse / of_coarse.mean();
  return {{difference, std::sqrt(influence.square().mean() / static_cast<double>(draws))}, fewer};
}

}  // namespace

Estimate evidence_of_finer_steps(const ChainSetting& setting, const std::vector<Specimen>& finer, std::int64_t most) {
  const ThetaPoint theta = make_theta(setting, setting.reference.centre, 1);
  const double accuracy = kStepError / 4 / std::sqrt(static_cast<double>(finer.size()));
  Estimate sum;
  for (std::size_t s = 0; s < finer.size(); ++s) {
    const bool lanes = posterior::ShotBatch(finer[s], theta.models[s]).at_once() > 1;
    const std::int64_t most_of_one = std::min(most, lanes ? kMostLaneDraws : kMostDraws);
    Change one;
    for (std::int64_t draws = std::min(kFirstDraws, most_of_one); draws <= most_of_one; draws *= kMoreDraws) {
      one = of_specimen(setting, theta, s, finer[s], draws);
      if (one.estimate.standard_error <= accuracy) break;
      // One counts in any case, and the others are not more in proportion.
      if ((one.effective - 1) * static_cast<double>(most_of_one) < kFewEffective * static_cast<double>(draws)) break;
    }
    sum.value += one.estimate.value;
    sum.standard_error = std::hypot(sum.standard_error, one.estimate.standard_error);
  }
  return sum;
}

PosteriorProblem with_finer_steps(PosteriorProblem problem) {
  for (matching::MatchingProblem& specimen : problem.specimens) specimen.grid.steps *= 2;
  for (Branch& branch : problem.tree) branch.grid.steps *= 2;
  return problem;
}

std::vector<Specimen> specimens_of(const PosteriorProblem& problem) {
  std::vector<Specimen> specimens;
  for (std::size_t i = 0; i < problem.specimens.size(); ++i)
    if (problem.pose == AlignmentKind::kNone)
      specimens.emplace_back(problem.specimens[i], problem.tree, problem.momenta);
    else
      specimens.emplace_back(problem.specimens[i], problem.pose, problem.momenta);
  return specimens;
}

namespace {

// Of twice as many steps, and the log evidence of the linear models.
struct OfSteps {
  Estimate finer;
  double laplace = 0;
};

OfSteps of_steps(const std::vector<Specimen>& specimens, const std::vector<Specimen>& finer,
                 const ParameterSpace& space, std::uint64_t seed) {
  Reference reference = make_reference(specimens, space, 1, seed);
  const double laplace = reference.laplace_log_evidence;
  defend(reference, specimens, space, 1);
  const ChainSetting setting{specimens, space, reference, {}, seed};
  return {evidence_of_finer_steps(setting, finer, kMostLaneDraws), laplace};
}

}  // namespace

PosteriorProblem with_sufficient_steps(PosteriorProblem problem, std::uint64_t seed) {
  const SerialBlas serial;
  const ParameterSpace space(problem);
  const Order order = problem.specimens.front().system.noise->traits().additive ? kOfAdditive : kOfOthers;
  std::vector<Specimen> specimens = specimens_of(problem);
  double laplace_before = kUndefined;
  for (int steps = problem.specimens.front().grid.steps; 2 * steps <= kMostSteps; steps *= 2) {
    PosteriorProblem twice = with_finer_steps(problem);
    std::vector<Specimen> finer = specimens_of(twice);
    try {
      const OfSteps found = of_steps(specimens, finer, space, seed);
      // Where weighted draws do not determine it: the linear models of half as many steps and of these.
      const double apart = found.finer.standard_error <= kStepError / 2
                               ? std::abs(found.finer.value)
                               : order.next * std::abs(found.laplace - laplace_before);
      if (order.to_limit * apart <= kStepError) return problem;
      laplace_before = found.laplace;
    } catch (const NumericalError&) {
      laplace_before = kUndefined;  // too few for these shapes
    }
    problem = std::move(twice);
    specimens = std::move(finer);
  }
  return problem;
}

}  // namespace pulson::inference
