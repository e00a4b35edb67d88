// Chains of paths that bend, where a narrow reference misses a tail or a minimum: against draws of the prior, and what
// confirms or refutes them.

#include "inference/confirmation.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

struct BentProblem {
  std::string name;
  std::vector<double> source, target;
  std::string noise, kernel;
  double sigma;
};

PosteriorProblem problem_of(const BentProblem& bent) {
  Landmarks source, target;
  source.points = Points::Map(bent.source.data(), 1, std::ssize(bent.source));
  target.points = Points::Map(bent.target.data(), 1, std::ssize(bent.target));
  matching::RegistrationOptions options;
  options.kernel = bent.kernel;
  options.noise = bent.noise;
  options.sigma = bent.sigma;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  options.grid = {1, 4};
  return make_posterior_problem(source, {target}, options, {});
}

// Draws of the prior, weighted by their likelihood.
struct OfPrior {
  Estimate log_evidence, momentum;
};
OfPrior weigh_prior(const PosteriorProblem& problem, int count) {
  const Specimen specimen(problem.specimens.front());
  const ParameterSpace space(problem);
  const Specimen::Model model = specimen.model(space.at({}));
  std::mt19937_64 bits(11);
  std::normal_distribution<double> normal;
  VectorXd weights(count), momenta(count);
  for (int i = 0; i < count; ++i) {
    const VectorXd z = VectorXd::NullaryExpr(specimen.unknowns(), [&] { return normal(bits); });
    const auto shot = specimen.shoot(model, z);
    weights[i] = shot ? std::exp(shot->log_likelihood) : 0;
    momenta[i] = shot ? shot->paths.front().initial().p(0, 0) : 0;
  }
  const double mean = weights.mean(), momentum = weights.dot(momenta) / weights.sum();
  return {{std::log(mean), std::sqrt(weights.squaredNorm() / count - mean * mean) / mean / std::sqrt(count)},
          {momentum, (weights.array() * (momenta.array() - momentum)).matrix().norm() / weights.sum()}};
}

const std::vector<BentProblem>& bent_problems() {
  static const std::vector<BentProblem> kProblems = {
      {"Swap", {0, 0.6}, {0.45, 0.2}, "ch-sd:beta=0.5", "gaussian:alpha=1", 0.1},
      {"Reversal", {0, 0.5, 1}, {0.9, 0.5, 0.2}, "ch-sd:beta=0.5", "gaussian:alpha=0.5", 0.15},
      {"Fields", {0, 0.7}, {0.6, 0.4}, "p-sd:beta=0.5,fields=grid,count=3,width=0.5", "gaussian:alpha=1", 0.1}};
  return kProblems;
}

const OfPrior& exact(std::size_t of) {
  static std::vector<OfPrior> found(bent_problems().size());
  if (found[of].log_evidence.standard_error == 0) found[of] = weigh_prior(problem_of(bent_problems()[of]), 400000);
  return found[of];
}

class BentPosterior : public testing::TestWithParam<std::tuple<std::size_t, const char*>> {};
INSTANTIATE_TEST_SUITE_P(All, BentPosterior,
                         testing::Combine(testing::Values(0U, 1U, 2U), testing::Values("hmc", "nuts", "pcn", "rto")),
                         [](const auto& of) {
                           return bent_problems()[std::get<0>(of.param)].name + "_" + std::get<1>(of.param);
                         });

// Within three of its own errors of the prior's draws; of the means only where nothing refutes them.
TEST_P(BentPosterior, IsThatOfThePriorsDrawsOrRefused) {
  const auto [of, method] = GetParam();
  SamplerOptions options;
  options.method = method;
  options.warmup = 250;
  options.draws = 500;
  const PosteriorDraws draws = sample_posterior(problem_of(bent_problems()[of]), options);
  const bool refused = draws.confirmation.by == Confirmation::By::kNothing
                           ? !(draws.pareto_k <= kHighParetoK && draws.chain_pareto_k <= kHighParetoK)
                           : !draws.confirmation.agrees;
  if (refused || rank_rhat(draws.by_chain(draws.momenta.front().row(0))) > kHighRhat) return;
  EXPECT_NEAR(draws.log_evidence.value, exact(of).log_evidence.value,
              3 * std::hypot(draws.log_evidence.standard_error, exact(of).log_evidence.standard_error));
  const DrawSummary momentum = summarise(draws.by_chain(draws.momenta.front().row(0)));
  EXPECT_NEAR(momentum.mean, exact(of).momentum.value,
              4 * std::hypot(momentum.mcse, exact(of).momentum.standard_error));
}

ImportanceEstimate weighted_draws(const PosteriorProblem& problem, std::int64_t most) {
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens{Specimen(problem.specimens.front())};
  Reference reference = make_reference(specimens, space, 1, 1);
  defend(reference, specimens, space, 1);
  return importance_estimate({specimens, space, reference, {}, 3}, most, 0.002);
}

TEST(WeightedDraws, HaveTheEvidenceAndMeansOfThePriorsDraws) {
  for (const std::size_t of : {0U, 1U, 2U}) {
    const ImportanceEstimate found = weighted_draws(problem_of(bent_problems()[of]), 200000);
    EXPECT_NEAR(found.log_evidence.value, exact(of).log_evidence.value,
                4 * std::hypot(found.log_evidence.standard_error, exact(of).log_evidence.standard_error));
    EXPECT_NEAR(found.numbers.front().value, exact(of).momentum.value,
                4 * std::hypot(found.numbers.front().standard_error, exact(of).momentum.standard_error));
  }
}

// Chains of one posterior and weighted draws of another.
TEST(Confirmation, RefutesChainsOfAnotherPosterior) {
  BentProblem bent = bent_problems().front();
  const PosteriorProblem problem = problem_of(bent);
  SamplerOptions options;
  options.method = "pcn";
  options.temperatures = 6;
  options.draws = 2000;
  const PosteriorDraws draws = sample_posterior(problem, options);
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens{Specimen(problem.specimens.front())};
  const Reference reference{};
  const ChainSetting setting{specimens, space, reference, {}, 1};
  EXPECT_TRUE(confirmed_by(weighted_draws(problem, 200000), setting, draws).agrees);
  bent.target[0] += 0.1;
  const Confirmation other = confirmed_by(weighted_draws(problem_of(bent), 200000), setting, draws);
  EXPECT_FALSE(other.agrees);
  EXPECT_GT(other.furthest, other.furthest_allowed);
}

// (U^{-k} − 1)/k is of the generalised Pareto law with shape k.
TEST(ParetoK, IsThatOfTheLaw) {
  std::mt19937_64 bits(5);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  for (const double k : {0.2, 0.5, 0.9}) {
    const VectorXd logs = VectorXd::NullaryExpr(20000, [&] { return -k * std::log(uniform(bits)); });
    EXPECT_NEAR(pareto_k(logs), k, 0.15) << k;
  }
  EXPECT_EQ(pareto_k(VectorXd::Constant(1000, -3.5)), 0);
  EXPECT_TRUE(std::isnan(pareto_k(VectorXd::Zero(10))));
}

}  // namespace
}  // namespace pulson::inference
