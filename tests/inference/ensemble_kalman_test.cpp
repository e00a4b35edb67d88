// The ensemble Kalman smoother against closed forms and Markov chains.

#include "pulson/inference/ensemble_kalman.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inference/localisation.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNowhere = std::numeric_limits<double>::infinity();

Landmarks shape_of(const Points& points) {
  Landmarks landmarks;
  landmarks.points = points;
  return landmarks;
}

Points ring(int count, double wave) {
  Points q(2, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    q.col(a) = (1 + wave * std::cos(3 * angle + 0.7)) * Eigen::Vector2d(std::cos(angle), 0.7 * std::sin(angle));
  }
  return q;
}

matching::RegistrationOptions models(const std::string& noise, double sigma, double lambda, int steps) {
  matching::RegistrationOptions options;
  options.kernel = "matern32:alpha=0.5";
  options.noise = noise;
  options.sigma = sigma;
  options.lambda = lambda;
  options.align = AlignmentKind::kNone;
  options.grid = {1, steps};
  return options;
}

// Displacements of 1e-4: q(1) = q0 + K p0 + βW(1) to about 1e-4 of the displacement.
constexpr double kSmall = 1e-4, kBeta = 0.5, kSigma = 0.3;  // the latter two in units of the first

PosteriorProblem small_problem(const Points& q0, const std::vector<Points>& moves) {
  std::vector<Landmarks> targets;
  for (const Points& move : moves) targets.push_back(shape_of(q0 + kSmall * move));
  return make_posterior_problem(shape_of(q0), targets,
                                models("ch-sd:beta=5e-5", kSmall * kSigma, 1 / (kSmall * kSmall), 4), {});
}

// p0 of one axis given the observed landmarks: mean and covariance, without ε.
struct ClosedForm {
  VectorXd mean;
  MatrixXd covariance;
};
ClosedForm closed_form(const Points& q0, const Eigen::RowVectorXd& move) {
  const MatrixXd k = make_kernel("matern32:alpha=0.5").gram(q0, q0);
  std::vector<Index> observed;
  for (Index a = 0; a < move.size(); ++a)
    if (std::isfinite(move[a])) observed.push_back(a);
  MatrixXd total = k(observed, observed);
  total.diagonal().array() += kBeta * kBeta + kSigma * kSigma;
  const MatrixXd gain = MatrixXd::Identity(q0.cols(), q0.cols())(Eigen::all, observed) * total.inverse();
  const MatrixXd picked = MatrixXd::Identity(q0.cols(), q0.cols())(observed, Eigen::all);
  return {kSmall * gain * move(observed).transpose(), kSmall * kSmall * (k.inverse() - gain * picked)};
}

EnsembleKalmanOptions ensemble(int members, double localisation, std::uint64_t seed = 1) {
  EnsembleKalmanOptions options;
  options.members = members;
  options.localisation = localisation;
  options.seed = seed;
  return options;
}

// Mean and standard error over independent ensembles of a statistic of each.
class Replicates {
 public:
  void add(double value) {
    ++count_;
    sum_ += value;
    squares_ += value * value;
  }
  double mean() const { return sum_ / count_; }
  double error() const { return std::sqrt((squares_ / count_ - mean() * mean()) / (count_ - 1)); }

 private:
  double count_ = 0, sum_ = 0, squares_ = 0;
};

// In the limit of many members: of m a fraction of n/m of each covariance is noise that each round fits.
void expect_closed_form(const Points& q0, const std::vector<Points>& moves) {
  constexpr int kMembers = 400, kReplicates = 12;
  const Index d = q0.rows(), n = q0.cols();
  const PosteriorProblem problem = small_problem(q0, moves);
  const std::size_t cells = moves.size() * static_cast<std::size_t>(d * n);
  std::vector<Replicates> means(cells), variances(cells), neighbours(cells);
  for (int r = 0; r < kReplicates; ++r) {
    const EnsembleDraws draws =
        sample_ensemble(problem, ensemble(kMembers, kNowhere, static_cast<std::uint64_t>(r) + 1));
    ASSERT_EQ(draws.draws.draws, kMembers);
    std::size_t cell = 0;
    for (const MatrixXd& p : draws.draws.momenta) {
      const MatrixXd from_mean = p.colwise() - p.rowwise().mean();
      for (Index row = 0; row < d * n; ++row, ++cell) {
        means[cell].add(p.row(row).mean());
        variances[cell].add(from_mean.row(row).squaredNorm() / (kMembers - 1));
        neighbours[cell].add(from_mean.row(row).dot(from_mean.row((row + d) % (d * n))) / (kMembers - 1));
      }
    }
  }
  const double bias = static_cast<double>(4 * d * n) / kMembers;
  std::size_t cell = 0;
  for (const Points& move : moves)
    for (Index a = 0; a < n; ++a)
      for (Index axis = 0; axis < d; ++axis, ++cell) {
        const ClosedForm exact = closed_form(q0, move.row(axis));
        const Index next = (a + 1) % n;
        EXPECT_NEAR(means[cell].mean(), exact.mean[a], 4 * means[cell].error() + bias * std::abs(exact.mean[a]));
        EXPECT_NEAR(variances[cell].mean(), exact.covariance(a, a),
                    4 * variances[cell].error() + bias * exact.covariance(a, a));
        EXPECT_NEAR(
            neighbours[cell].mean(), exact.covariance(a, next),
            4 * neighbours[cell].error() + bias * std::sqrt(exact.covariance(a, a) * exact.covariance(next, next)));
      }
}

TEST(EnsembleKalman, OfSmallDeformationsIsTheClosedFormOnALine) {
  const Points q0 = (Points(1, 3) << 0, 0.6, 1.1).finished();
  expect_closed_form(q0, {(Points(1, 3) << 1, -0.5, 0.3).finished(), (Points(1, 3) << -1.5, 0.2, 1).finished()});
}

TEST(EnsembleKalman, OfSmallDeformationsIsTheClosedFormInThePlaneWithAMissingLandmark) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Points q0 = (Points(2, 3) << 0, 0.6, 0.2, 0, 0.2, 0.5).finished();
  expect_closed_form(q0, {(Points(2, 3) << 1, nan, 0.3, 0.2, nan, -1).finished()});
}

TEST(EnsembleKalman, OfSmallDeformationsIsTheClosedFormInSpace) {
  const Points q0 = (Points(3, 2) << 0, 0.5, 0, 0.2, 0, -0.3).finished();
  expect_closed_form(q0, {(Points(3, 2) << 1, -0.5, 0.3, 0.2, 0.8, -1).finished()});
}

// Paths, too: q(t) = q0 + t p0 + βW(t).
TEST(EnsembleKalman, OfAFreePulsonHasTheClosedFormsOfItsPath) {
  const double beta = 0.7, sigma = 0.3, y = 1.5, total = 1 + beta * beta + sigma * sigma;
  const PosteriorProblem problem = make_posterior_problem(
      shape_of(Points::Zero(1, 1)), {shape_of(Points::Constant(1, 1, y))}, models("ch-sd:beta=0.7", sigma, 1, 8), {});
  Replicates middle, middle_variance, end, end_variance;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const EnsembleDraws draws = sample_ensemble(problem, ensemble(400, kNowhere, seed));
    for (const auto& [rows, mean, variance] : {std::tuple(&draws.draws.middles, &middle, &middle_variance),
                                               std::tuple(&draws.draws.ends, &end, &end_variance)}) {
      const Eigen::RowVectorXd q = rows->front().row(0);
      mean->add(q.mean());
      variance->add((q.array() - q.mean()).square().sum() / static_cast<double>(q.size() - 1));
    }
  }
  const double half = 0.5 + 0.5 * beta * beta, whole = 1 + beta * beta;  // cov(q(½), q(1)), var q(1)
  EXPECT_NEAR(middle.mean(), y * half / total, 4 * middle.error());
  EXPECT_NEAR(end.mean(), y * whole / total, 4 * end.error());
  const double of_middle = 0.25 + 0.5 * beta * beta - half * half / total, of_end = whole - whole * whole / total;
  EXPECT_NEAR(middle_variance.mean(), of_middle, 4 * middle_variance.error() + 0.01 * of_middle);
  EXPECT_NEAR(end_variance.mean(), of_end, 4 * end_variance.error() + 0.01 * of_end);
}

VectorXd deviations(const MatrixXd& draws) {
  const MatrixXd from_mean = draws.colwise() - draws.rowwise().mean();
  return (from_mean.rowwise().squaredNorm() / static_cast<double>(draws.cols() - 1)).cwiseSqrt();
}

// Root mean square of the errors of the means, in posterior deviations.
double mean_error(const MatrixXd& draws, const MatrixXd& exact) {
  const VectorXd difference = draws.rowwise().mean() - exact.rowwise().mean();
  return std::sqrt((difference.array() / deviations(exact).array()).square().mean());
}

double deviation_ratio(const MatrixXd& draws, const MatrixXd& exact) {
  return std::exp((deviations(draws).array() / deviations(exact).array()).log().mean());
}

// Landmarks move by up to 15 % of the radius, σ is 2 % of it. The error has no bound known beforehand: docs/sampling.md
// lists what was measured for another shape.
TEST(EnsembleKalman, OfARingIsNearToMarkovChains) {
  const PosteriorProblem problem = make_posterior_problem(shape_of(ring(16, 0)), {shape_of(ring(16, 0.15))},
                                                          models("ch-sd:beta=0.05", 0.02, 50, 8), {});
  SamplerOptions chains;
  chains.draws = 400;
  chains.warmup = 150;
  chains.searches = 1;
  chains.evidence = false;
  const PosteriorDraws exact = sample_posterior(problem, chains);
  const EnsembleDraws draws = sample_ensemble(problem, EnsembleKalmanOptions{.members = 200});
  EXPECT_TRUE(std::isfinite(draws.localisation.front()));
  EXPECT_LT(mean_error(draws.draws.momenta.front(), exact.momenta.front()), 0.3);
  EXPECT_LT(mean_error(draws.draws.middles.front(), exact.middles.front()), 0.4);
  EXPECT_NEAR(deviation_ratio(draws.draws.momenta.front(), exact.momenta.front()), 1, 0.15);
  EXPECT_NEAR(deviation_ratio(draws.draws.middles.front(), exact.middles.front()), 1, 0.15);
  EXPECT_LT(draws.misfit, 2.5);
}

// Of the velocities, whose exact mean is K times that of p0.
double velocity_error(const PosteriorProblem& problem, const Points& q0, const Points& move,
                      const EnsembleKalmanOptions& options) {
  const MatrixXd k = make_kernel("matern32:alpha=0.5").gram(q0, q0);
  const VectorXd mean = sample_ensemble(problem, options).draws.momenta.front().rowwise().mean();
  const Points velocity = Points(mean.reshaped(q0.rows(), q0.cols())) * k;
  double square = 0;
  for (Index axis = 0; axis < q0.rows(); ++axis)
    square += (velocity.row(axis).transpose() - k * closed_form(q0, move.row(axis)).mean).squaredNorm();
  return std::sqrt(square / static_cast<double>(q0.size())) / kSmall;
}

TEST(EnsembleKalman, NeedsLocalisationWhereMembersAreFew) {
  const Points q0 = ring(60, 0);
  const Points move = 10 * (ring(60, 0.15) - q0);
  const PosteriorProblem problem = small_problem(q0, {move});
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    EnsembleKalmanOptions local{.members = 40, .seed = seed};
    const double with = velocity_error(problem, q0, move, local);
    const double without = velocity_error(problem, q0, move, ensemble(40, kNowhere, seed));
    EXPECT_LT(with, 0.7 * without);
  }
}

// 150 landmarks that move by up to five deviations: with Σ⁻¹/8 from the first round on members extrapolate, to a misfit
// of 1.36.
TEST(EnsembleKalman, TakesMoreRoundsWhereMembersAreFarFromTheTarget) {
  const PosteriorProblem far = make_posterior_problem(shape_of(ring(150, 0)), {shape_of(ring(150, 0.1))},
                                                      models("p-sd:beta=0.04,fields=grid,count=3", 0.02, 50, 5), {});
  const EnsembleDraws draws = sample_ensemble(far, EnsembleKalmanOptions{.members = 60, .localisation = 1.5});
  EXPECT_GT(draws.rounds, 8);
  EXPECT_EQ(draws.lost, 0);
  EXPECT_LT(draws.misfit, 1.25);
  const Points q0 = ring(8, 0);
  const PosteriorProblem near = make_posterior_problem(shape_of(q0), {shape_of(q0)}, models("none", 1, 50, 5), {});
  EXPECT_EQ(sample_ensemble(near, {}).rounds, 8);
  EXPECT_EQ(sample_ensemble(near, {.rounds = 250}).rounds, 250);
}

TEST(EnsembleKalman, GivesTheSameBitsForAnyNumberOfThreads) {
  const PosteriorProblem problem =
      make_posterior_problem(shape_of(ring(12, 0)), {shape_of(ring(12, 0.1)), shape_of(ring(12, -0.1))},
                             models("kunita:beta=0.05,width=0.5", 0.02, 50, 4), {});
  set_thread_count(1);
  const EnsembleDraws one = sample_ensemble(problem, EnsembleKalmanOptions{.members = 30});
  set_thread_count(2);
  const EnsembleDraws two = sample_ensemble(problem, EnsembleKalmanOptions{.members = 30});
  set_thread_count(0);
  EXPECT_EQ(one.draws.momenta, two.draws.momenta);
  EXPECT_EQ(one.draws.ends, two.draws.ends);
  EXPECT_EQ(one.draws.log_likelihood, two.draws.log_likelihood);
  EXPECT_NE(one.draws.momenta[0], one.draws.momenta[1]);
}

// At the prior's momenta these time steps are too coarse for many paths.
TEST(EnsembleKalman, DropsMembersWithoutAPath) {
  const auto problem = [](double lambda) {
    return make_posterior_problem(shape_of(ring(30, 0)), {shape_of(ring(30, 0.15))},
                                  models("ch-sd:beta=0.05", 0.02, lambda, 8), {});
  };
  const EnsembleDraws draws = sample_ensemble(problem(20), EnsembleKalmanOptions{.members = 60});
  EXPECT_GT(draws.lost, 0);
  EXPECT_EQ(draws.draws.draws, 60 - draws.lost);
  EXPECT_TRUE(draws.draws.momenta.front().allFinite());
  EXPECT_TRUE(draws.draws.ends.front().allFinite());
  EXPECT_EQ(draws.draws.paths.front().size(), draws.draws.kept.size());
  EXPECT_THROW(sample_ensemble(problem(0.1), EnsembleKalmanOptions{.members = 60}), NumericalError);
}

TEST(EnsembleKalman, RefusesWhatItCannotSample) {
  const PosteriorProblem problem = small_problem(ring(4, 0), {ring(4, 0.1)});
  EXPECT_THROW(sample_ensemble(problem, {.members = 19}), InputError);
  EXPECT_THROW(sample_ensemble(problem, {.rounds = 0}), InputError);
  EXPECT_THROW(sample_ensemble(problem, {.localisation = 0.0}), InputError);
  EXPECT_THROW(sample_ensemble(problem, {.localisation = std::nan("")}), InputError);
  EXPECT_THROW(sample_ensemble(problem, {.paths_kept = 0}), InputError);
  PosteriorProblem with_parameters = problem;
  with_parameters.parameters = {{"beta", 1, 0.5}};
  EXPECT_THROW(sample_ensemble(with_parameters, {}), InputError);
  PosteriorProblem tree = problem;
  tree.tree.emplace_back();
  EXPECT_THROW(sample_ensemble(tree, {}), InputError);
}

TEST(Localisation, FallsFromOneToZeroSmoothly) {
  EXPECT_DOUBLE_EQ(gaspari_cohn(0, 2), 1);
  EXPECT_NEAR(gaspari_cohn(1, 2), 5.0 / 24, 1e-15);
  EXPECT_NEAR(gaspari_cohn(1 + 1e-9, 2), 5.0 / 24, 1e-8);
  EXPECT_NEAR(gaspari_cohn(2 - 1e-6, 2), 0, 1e-12);
  EXPECT_EQ(gaspari_cohn(2, 2), 0);
  EXPECT_EQ(gaspari_cohn(1e9, kNowhere), 1);
  for (double r = 0.01; r < 2; r += 0.01) EXPECT_LT(gaspari_cohn(r, 2), gaspari_cohn(r - 0.01, 2));
}

TEST(Localisation, FindsWhereChannelsAct) {
  const Landmarks shape = shape_of(ring(20, 0));
  const auto sites = [&](const std::string& noise) {
    return channel_sites(*make_noise(noise, shape), shape.points, 0.5);
  };
  for (const char* const noise : {"ch-sd:beta=1", "trouve-vialard:sigma=1", "kunita:beta=1,width=0.1"}) {
    const ChannelSites found = sites(noise);
    EXPECT_TRUE(found.wide.empty()) << noise;
    for (std::size_t a = 0; a < 20; ++a)
      EXPECT_THAT(found.of_landmark[a], testing::ElementsAre(static_cast<Index>(2 * a), static_cast<Index>(2 * a + 1)))
          << noise;
  }
  EXPECT_EQ(sites("p-sd:beta=1").wide.size(), 2U);  // translations
  const ChannelSites bump = sites("p-sd:beta=1,fields=bump,center=1/0,width=0.3");
  EXPECT_THAT(bump.wide, testing::IsEmpty());
  EXPECT_EQ(bump.of_landmark[0].size(), 2U);
}

}  // namespace
}  // namespace pulson::inference
