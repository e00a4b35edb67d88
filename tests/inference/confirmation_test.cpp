// Chains of paths that bend, where a narrow reference misses a tail or a minimum: against draws of the prior, and what
// confirms or refutes them.

#include "inference/confirmation.hpp"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "inference/finer_steps.hpp"
#include "inference/gaussian_mixture.hpp"
#include "inference/importance.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

struct BentProblem {
  std::string name;
  int dimension;
  std::vector<double> source, target;
  std::string noise, kernel;
  double sigma;
};

PosteriorProblem problem_of(const BentProblem& bent, const std::string& integrator = "heun") {
  const auto shape = [&](const std::vector<double>& numbers) {
    Landmarks made;
    made.points = Points::Map(numbers.data(), bent.dimension, std::ssize(numbers) / bent.dimension);
    return made;
  };
  matching::RegistrationOptions options;
  options.kernel = bent.kernel;
  options.noise = bent.noise;
  options.sigma = bent.sigma;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  options.integrator = integrator;
  options.grid = {1, 4};
  return make_posterior_problem(shape(bent.source), {shape(bent.target)}, options, {});
}

// Numbers of paths whose means are compared: p0 of the first landmark, its square, and whether at T/2 the last
// coordinate of the first landmark is above that of the second.
std::array<double, 3> numbers_of(double momentum, const Eigen::Ref<const VectorXd>& middle, int dimension) {
  return {momentum, momentum * momentum, middle[dimension - 1] > middle[2 * dimension - 1] ? 1.0 : 0.0};
}

// Draws of the prior, weighted by their likelihood.
struct OfPrior {
  Estimate log_evidence;
  std::array<Estimate, 3> numbers;
};
OfPrior weigh_prior(const PosteriorProblem& problem, int count) {
  constexpr int kBlock = 1000;
  const Specimen specimen(problem.specimens.front());
  const ParameterSpace space(problem);
  const Specimen::Model model = specimen.model(space.at({}));
  const posterior::ShotBatch shots(specimen, model);
  const auto dimension = static_cast<int>(problem.specimens.front().source.rows());
  std::mt19937_64 bits(11);
  std::normal_distribution<double> normal;
  VectorXd weights(count);
  Eigen::MatrixXd numbers(3, count);
  for (int first = 0; first < count; first += kBlock) {
    const Eigen::MatrixXd z = Eigen::MatrixXd::NullaryExpr(specimen.unknowns(), kBlock, [&] { return normal(bits); });
    const auto ends = shots.ends(z);
    weights.segment(first, kBlock) = shots.log_likelihoods(ends).array().exp();
    for (int i = 0; i < kBlock; ++i) {
      const auto of_path = numbers_of(specimen.momenta(model, z.col(i))(0, 0), ends.middles.col(i), dimension);
      numbers.col(first + i) = Eigen::Vector3d::Map(of_path.data());
    }
  }
  const double mean = weights.mean();
  OfPrior found{{std::log(mean), std::sqrt(weights.squaredNorm() / count - mean * mean) / mean / std::sqrt(count)}, {}};
  for (Index k = 0; k < 3; ++k) {
    const double of_k = numbers.row(k).dot(weights) / weights.sum();
    const double error = (weights.array() * (numbers.row(k).transpose().array() - of_k)).matrix().norm();
    found.numbers[static_cast<std::size_t>(k)] = {of_k, error / weights.sum()};
  }
  return found;
}

const std::vector<BentProblem>& bent_problems() {
  static const std::vector<BentProblem> kProblems = {
      {"Swap", 1, {0, 0.6}, {0.45, 0.2}, "ch-sd:beta=0.5", "gaussian:alpha=1", 0.1},
      {"Reversal", 1, {0, 0.5, 1}, {0.9, 0.5, 0.2}, "ch-sd:beta=0.5", "gaussian:alpha=0.5", 0.15},
      {"Fields", 1, {0, 0.7}, {0.6, 0.4}, "p-sd:beta=0.5,fields=grid,count=3,width=0.5", "gaussian:alpha=1", 0.1},
      {"NearlyOnePlace", 2, {0, 0, 0.1, 0}, {0.15, 0.05, 0, 0}, "ch-sd:beta=0.3", "gaussian:alpha=0.5", 0.1},
      {"VagueSwap", 1, {0, 0.6}, {0.45, 0.2}, "ch-sd:beta=0.5", "gaussian:alpha=1", 0.4},
      {"TwoWays", 2, {0, 0, 1, 0}, {0.8, 0.05, 0.2, 0}, "none", "gaussian:alpha=1", 0.3}};
  return kProblems;
}

const OfPrior& exact(std::size_t of) {
  static std::vector<OfPrior> found(bent_problems().size());
  if (found[of].log_evidence.standard_error == 0) found[of] = weigh_prior(problem_of(bent_problems()[of]), 400000);
  return found[of];
}

bool is_refused(const PosteriorDraws& draws) {
  const bool refuted = draws.confirmation.by == Confirmation::By::kNothing
                           ? !(draws.pareto_k <= kHighParetoK && draws.chain_pareto_k <= kHighParetoK)
                           : !draws.confirmation.agrees;
  return refuted || !(rank_rhat(draws.by_chain(draws.momenta.front().row(0))) <= kHighRhat);
}

class BentPosterior : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(All, BentPosterior, testing::Values(0U, 4U, 5U),
                         [](const auto& of) { return bent_problems()[of.param].name; });

// The evidence of the prior's draws, without what the confirmation adds to its error, and their means; of the last two
// problems of every method, whose chains are not refused. Of the first, chains this short of at most two are.
TEST_P(BentPosterior, IsThatOfThePriorsDraws) {
  const std::size_t of = GetParam();
  const BentProblem& bent = bent_problems()[of];
  std::string refused;
  int count = 0;
  for (const char* method : {"hmc", "nuts", "pcn", "rto"}) {
    SCOPED_TRACE(method);
    SamplerOptions options;
    options.method = method;
    options.warmup = 250;
    options.draws = 500;
    const PosteriorDraws draws = sample_posterior(problem_of(bent), options);
    if (is_refused(draws)) {
      refused += std::string(method) + ' ';
      ++count;
      continue;
    }
    const double own =
        std::sqrt(std::pow(draws.log_evidence.standard_error, 2) - std::pow(draws.confirmation.difference, 2));
    EXPECT_NEAR(draws.log_evidence.value, exact(of).log_evidence.value,
                4 * std::hypot(own, exact(of).log_evidence.standard_error));
    Eigen::MatrixXd numbers(3, draws.log_likelihood.size());
    for (Index i = 0; i < numbers.cols(); ++i) {
      const auto of_path = numbers_of(draws.momenta.front()(0, i), draws.middles.front().col(i), bent.dimension);
      numbers.col(i) = Eigen::Vector3d::Map(of_path.data());
    }
    for (Index k = 0; k < 3; ++k) {
      const Estimate& expected = exact(of).numbers[static_cast<std::size_t>(k)];
      const DrawSummary found = summarise(draws.by_chain(numbers.row(k)));
      EXPECT_NEAR(found.mean, expected.value, 4 * std::hypot(found.mcse, expected.standard_error)) << k;
    }
  }
  EXPECT_LE(count, of == 0 ? 2 : 0) << refused;
}

ImportanceEstimate weighted_draws(const PosteriorProblem& problem, std::int64_t most) {
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens{Specimen(problem.specimens.front())};
  Reference reference = make_reference(specimens, space, 1, 1);
  defend(reference, specimens, space, 1);
  return importance_estimate({specimens, space, reference, {}, 3}, most, 0.01);
}

TEST(WeightedDraws, HaveTheEvidenceAndMeansOfThePriorsDraws) {
  for (const std::size_t of : {1U, 2U, 3U}) {
    const ImportanceEstimate found = weighted_draws(problem_of(bent_problems()[of]), 200000);
    EXPECT_NEAR(found.log_evidence.value, exact(of).log_evidence.value,
                4 * std::hypot(found.log_evidence.standard_error, exact(of).log_evidence.standard_error));
    EXPECT_NEAR(found.numbers.front().value, exact(of).numbers[0].value,
                4 * std::hypot(found.numbers.front().standard_error, exact(of).numbers[0].standard_error));
  }
}

// Landmarks that change places in the plane turn either way, as likely by symmetry, but the reference is about one way.
TEST(WeightedDraws, FindAMinimumThatNoSearchHasFound) {
  const PosteriorProblem problem =
      problem_of({"EvenSwap", 2, {0, 0, 1, 0}, {0.9, 0, 0.1, 0}, "trouve-vialard:sigma=0.5", "gaussian:alpha=1", 0.1});
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens{Specimen(problem.specimens.front())};
  Reference reference = make_reference(specimens, space, 1, 1);
  reference.minima.front().resize(1);
  reference.log_weights.front() = VectorXd::Zero(1);
  defend(reference, specimens, space, 1);
  const ImportanceEstimate found = importance_estimate({specimens, space, reference, {}, 3}, 50000, 0.01);
  EXPECT_TRUE(is_of_use(found));
  constexpr std::size_t kMomenta = 4, kEnds = 4;
  const Estimate& side = found.numbers[kMomenta + kEnds + 1];  // of the first landmark at T/2
  EXPECT_NEAR(side.value, 0, 4 * side.standard_error);
  EXPECT_LT(side.standard_error, 0.01);
}

// Against their sum in closed form on a line; the prior is a tenth.
TEST(GaussianMixture, HasTheDensityOfItsDraws) {
  std::mt19937_64 bits(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd points = Eigen::MatrixXd::NullaryExpr(2, 4000, [&] { return 1 + 0.2 * normal(bits); });
  points.leftCols(1000).array() -= 3;
  const GaussianMixture mixture(points, Eigen::ArrayXd::Constant(4000, 1.0 / 4000));
  constexpr Index kDraws = 100000;
  const Eigen::MatrixXd normals = Eigen::MatrixXd::NullaryExpr(2, kDraws, [&] { return normal(bits); });
  std::uniform_real_distribution<double> uniform;
  const Eigen::MatrixXd z = mixture.draw(VectorXd::NullaryExpr(kDraws, [&] { return uniform(bits); }), normals);
  // Of draws N(0, I) the mean of the relative density is 1; and of its own draws that of the inverse.
  const VectorXd of_prior = mixture.log_densities(normals), own = mixture.log_densities(z);
  const Eigen::ArrayXd relative = of_prior.array().exp(), inverse = (-own.array()).exp();
  const auto error = [](const Eigen::ArrayXd& x) { return std::sqrt((x - x.mean()).square().mean() / kDraws); };
  EXPECT_NEAR(relative.mean(), 1, 4 * error(relative));
  EXPECT_NEAR(inverse.mean(), 1, 4 * error(inverse));
  EXPECT_LE(inverse.maxCoeff(), 10.0001);
  // A quarter of the points is about −2, and of the law of all 0.21; the prior has nothing there but its tail.
  const double near = static_cast<double>((z.array() < -1.2).colwise().all().count()) / kDraws;
  EXPECT_NEAR(near, 0.8 / 4 + 0.1 * 0.21 + 0.1 * 0.115 * 0.115, 0.01);
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

// Of weighted draws of the prior with so many steps and with twice as many.
TEST(FinerSteps, ChangeTheEvidenceAsThePriorsDrawsSay) {
  const PosteriorProblem problem = problem_of(bent_problems().front());
  const PosteriorProblem finer = with_finer_steps(problem);
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens = specimens_of(problem);
  Reference reference = make_reference(specimens, space, 1, 1);
  defend(reference, specimens, space, 1);
  const Estimate found = evidence_of_finer_steps({specimens, space, reference, {}, 3}, specimens_of(finer), 64000);
  const Estimate fine = weigh_prior(finer, 400000).log_evidence, coarse = exact(0).log_evidence;
  EXPECT_NEAR(found.value, fine.value - coarse.value,
              4 * std::hypot(found.standard_error, std::hypot(fine.standard_error, coarse.standard_error)));
  EXPECT_LT(found.standard_error, 0.02);
}

// Of one draw that outweighs all others the difference is known, and its error would be 0.
TEST(FinerSteps, AreUndeterminedByFewDraws) {
  BentProblem bent = bent_problems().front();
  bent.sigma = 1e-3;
  const PosteriorProblem problem = problem_of(bent);
  const ParameterSpace space(problem);
  const std::vector<Specimen> specimens = specimens_of(problem);
  Reference reference = make_reference(specimens, space, 1, 1);
  defend(reference, specimens, space, 1);
  const ChainSetting setting{specimens, space, reference, {}, 3};
  EXPECT_TRUE(std::isnan(evidence_of_finer_steps(setting, specimens_of(with_finer_steps(problem)), 1000).value));
}

// Heun's steps lose no path, and few of them do; a path that hardly bends needs the fewest.
TEST(SufficientSteps, AreThoseOfWhichTheEvidenceIsNearItsLimit) {
  const auto chosen = [](PosteriorProblem problem) {
    return with_sufficient_steps(std::move(problem)).specimens.front().grid.steps;
  };
  const int bent = chosen(problem_of(bent_problems().front()));
  EXPECT_GE(bent, 8);  // 4 are 0.05 from the limit by the prior's draws
  EXPECT_LE(bent, 32);
  BentProblem straight = bent_problems().front();
  straight.target = {0.05, 0.62};
  straight.noise = "ch-sd:beta=0.05";
  EXPECT_EQ(chosen(problem_of(straight)), 4);
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
