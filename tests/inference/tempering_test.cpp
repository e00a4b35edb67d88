// Parallel tempering: two landmarks on a line that change places, early or late, against draws of the prior.

#include "inference/tempering.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::inference {
namespace {

using Eigen::VectorXd;

PosteriorProblem swap_on_a_line(const std::vector<std::string>& parameters) {
  Landmarks source, target;
  source.points.resize(1, 2);
  source.points << 0, 1;
  target.points.resize(1, 2);
  target.points << 1, 0;
  matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=0.5";
  options.noise = "ch-sd:beta=0.5";
  options.sigma = 0.1;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  options.grid = {1, 2};
  return make_posterior_problem(source, {target}, options, parameters);
}

// Weighted by the likelihood: the evidence, and the probability that landmarks have passed each other halfway.
struct BruteForce {
  double log_evidence = 0, error = 0, early = 0, early_error = 0;
};

BruteForce draw_prior(const PosteriorProblem& problem, int count) {
  const Specimen specimen(problem.specimens.front());
  const ParameterSpace space(problem);
  std::mt19937_64 bits(7);
  std::normal_distribution<double> normal;
  VectorXd weights(count), early(count);
  for (int i = 0; i < count; ++i) {
    const VectorXd phi = VectorXd::NullaryExpr(space.count(), [&] { return normal(bits); });
    const VectorXd z = VectorXd::NullaryExpr(specimen.unknowns(), [&] { return normal(bits); });
    const auto shot = specimen.shoot(specimen.model(space.at(phi)), z);
    weights[i] = shot ? std::exp(shot->log_likelihood) : 0;
    early[i] = shot && shot->paths[0].states[1].q(0, 0) > shot->paths[0].states[1].q(0, 1) ? 1 : 0;
  }
  const double mean = weights.mean();
  const double fraction = weights.dot(early) / weights.sum();
  return {std::log(mean), std::sqrt(weights.squaredNorm() / count - mean * mean) / mean / std::sqrt(count), fraction,
          (weights.array() * (early.array() - fraction)).matrix().norm() / weights.sum()};
}

class SwapOnALine : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(SwapOnALine, IsVisitedAsPriorDrawsSay) {
  const PosteriorProblem problem = swap_on_a_line(GetParam());
  const BruteForce expected = draw_prior(problem, 200000);
  SamplerOptions options;
  options.method = "pcn";
  options.temperatures = 8;
  options.draws = 4000;
  const PosteriorDraws draws = sample_posterior(problem, options);
  EXPECT_NEAR(draws.log_evidence.value, expected.log_evidence,
              4 * std::hypot(draws.log_evidence.standard_error, expected.error));
  EXPECT_LT(draws.log_evidence.standard_error, 0.12);  // the distance to weighted draws is in it
  const auto& middle = draws.middles.front();
  const DrawSummary early =
      summarise(draws.by_chain((middle.row(0).array() > middle.row(1).array()).cast<double>().matrix()));
  EXPECT_NEAR(early.mean, expected.early, 4 * std::hypot(early.mcse, expected.early_error));
  EXPECT_LT(early.mcse, 0.05);
  EXPECT_GT(expected.early, 0.1);
  EXPECT_LT(expected.early, 0.9);
}

INSTANTIATE_TEST_SUITE_P(Parameters, SwapOnALine,
                         testing::Values(std::vector<std::string>{}, std::vector<std::string>{"beta", "alpha"}));

TEST(Tempering, DrawsTheSameBitsForAnyNumberOfThreads) {
  SamplerOptions options;
  options.temperatures = 4;
  options.warmup = 16;
  options.draws = 20;
  const PosteriorProblem problem = swap_on_a_line({"beta"});
  set_thread_count(1);
  const PosteriorDraws one = sample_posterior(problem, options);
  set_thread_count(3);
  const PosteriorDraws three = sample_posterior(problem, options);
  set_thread_count(0);
  EXPECT_EQ(one.momenta.front(), three.momenta.front());
  EXPECT_EQ(one.tempered_log_likelihood, three.tempered_log_likelihood);
  EXPECT_EQ(one.powers, three.powers);
}

TEST(Tempering, PowersAreRetunedToEqualRejection) {
  const std::vector<double> powers = first_powers(4);
  EXPECT_EQ(powers.front(), 0);
  EXPECT_EQ(powers.back(), 1);
  // All of the rejections are between the last two: the others move there.
  const std::vector<double> made = retuned({0, 0.25, 0.5, 1}, {0, 0, 0.9});
  EXPECT_NEAR(made[1], 0.5 + 0.5 * (0.902 / 3 - 0.002) / 0.9, 1e-12);
  EXPECT_NEAR(made[2], 0.5 + 0.5 * (2 * 0.902 / 3 - 0.002) / 0.9, 1e-12);
  EXPECT_EQ(retuned({0, 0.3, 1}, {0.4, 0.4}), (std::vector<double>{0, 0.3, 1}));
}

TEST(Tempering, NeedsATemperature) {
  SamplerOptions options;
  options.temperatures = 0;
  EXPECT_THROW(sample_posterior(swap_on_a_line({}), options), InputError);
}

class Interrupted : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Temperatures, Interrupted, testing::Values(1, 4));

// Wherever it is ended, and with other threads.
TEST_P(Interrupted, SamplingGoesOnToTheSameBits) {
  const PosteriorProblem problem = swap_on_a_line({"beta=0.3"});
  SamplerOptions options;
  options.temperatures = GetParam();
  options.chains = 2;
  options.warmup = 40;
  options.draws = 60;
  const PosteriorDraws whole = sample_posterior(problem, options);
  EXPECT_FALSE(whole.partial);
  int parts = 0;
  int states = 0;
  PosteriorDraws draws;
  const int threads = thread_count();
  do {
    ASSERT_LT(++parts, 100);
    set_thread_count(1 + parts % 2);
    options.on_state = [&](const std::function<std::string()>& state) {
      if (++states % 3 != 0) return true;
      options.state = state();
      return false;
    };
    draws = sample_posterior(problem, options);
  } while (draws.partial);
  set_thread_count(threads);
  EXPECT_GT(parts, 3);
  EXPECT_EQ(draws.parameters, whole.parameters);
  EXPECT_EQ(draws.ends, whole.ends);
  EXPECT_EQ(draws.paths, whole.paths);
  EXPECT_EQ(draws.log_weight, whole.log_weight);
  EXPECT_EQ(draws.log_evidence.value, whole.log_evidence.value);
  EXPECT_EQ(draws.acceptance, whole.acceptance);
  EXPECT_EQ(draws.exchanged, whole.exchanged);
}

TEST(Interrupted, RefusesWhatIsNoState) {
  const PosteriorProblem problem = swap_on_a_line({"beta=0.3"});
  SamplerOptions options;
  options.chains = 1;
  options.warmup = 4;
  options.draws = 4;
  std::string state;
  options.on_state = [&](const std::function<std::string()>& of_chains) {
    state = of_chains();
    return false;
  };
  sample_posterior(problem, options);
  for (const std::string& wrong : {state.substr(0, state.size() / 2), state + "more", std::string(40, '\xff')}) {
    options.state = wrong;
    EXPECT_THROW(sample_posterior(problem, options), InputError);
  }
  options.state = state;
  EXPECT_THROW(sample_posterior(swap_on_a_line({}), options), InputError);
}

}  // namespace
}  // namespace pulson::inference
