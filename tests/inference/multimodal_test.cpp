// Several minima: two landmarks in the plane that change places, by turning either way.

#include <cmath>

#include <gtest/gtest.h>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {
namespace {

using Eigen::MatrixXd;

PosteriorProblem swap(double shift, double sigma) {
  Landmarks source, target;
  source.points.resize(2, 2);
  source.points << 0, 1, 0, 0;
  target.points.resize(2, 2);
  target.points << 1, 0, shift, shift;
  matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.noise = "ch-sd:beta=0.3";
  options.sigma = sigma;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  options.grid = {1, 10};
  return make_posterior_problem(source, {target}, options, {});
}

// Whether landmark 1 is above landmark 2 halfway.
Eigen::RowVectorXd above(const PosteriorDraws& draws) {
  const MatrixXd& q = draws.middles.front();
  return (q.row(1).array() > q.row(3).array()).cast<double>();
}

TEST(SeveralModes, OfASwapAreVisitedAlikeBySymmetry) {
  SamplerOptions options;
  options.draws = 1000;
  options.searches = 12;
  const PosteriorDraws draws = sample_posterior(swap(0, 0.3), options);
  EXPECT_GE(draws.modes, 2);
  const DrawSummary summary = summarise(draws.by_chain(above(draws)));
  EXPECT_GT(effective_sample_size(draws.by_chain(above(draws))), 100);
  EXPECT_NEAR(summary.mean, 0.5, 4 * summary.mcse);
}

// One search finds both ways: the second is among the minima of registration.
TEST(SeveralModes, AreThoseOfRegistration) {
  SamplerOptions options;
  options.chains = 1;
  options.warmup = 10;
  options.draws = 10;
  options.searches = 1;
  EXPECT_EQ(sample_posterior(swap(0.2, 0.1), options).modes, 2);
}

}  // namespace
}  // namespace pulson::inference
