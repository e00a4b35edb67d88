#include <numeric>

#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "cohort/anderson.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;

std::vector<Index> all_of(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// Bends the oval by a third of its diameter.
Points bent(const Points& q0) {
  Points y = q0;
  for (Index a = 0; a < y.cols(); ++a) y(1, a) += 0.5 * q0(0, a) * q0(0, a) + 0.1 * std::sin(5 * q0(0, a));
  return y;
}

struct Matched {
  GeodesicMatch match;
  double cost;
};

Matched match(const CohortLaw& law, const Points& q0, const Points& target, int steps) {
  const TemplateMetric metric(law.kernel, 0, law.lambda * law.sigma * law.sigma, q0);
  const MatchModel model(metric, all_of(q0.cols()));
  Matched found{Geodesics(law.kernel, steps).match(metric, model, target, 0 * q0, 1e-12), 0};
  found.cost = law.lambda * hamiltonian(law.kernel, {q0, found.match.momenta});
  if (law.sigma > 0) found.cost += 0.5 * (found.match.end.q - target).squaredNorm() / (law.sigma * law.sigma);
  return found;
}

TEST(Anderson, SolvesALinearSystemInAsManyStepsAsItHasUnknowns) {
  const Eigen::MatrixXd a{{1.3, 0.2, 0}, {0.1, 0.8, 0.3}, {0, -0.2, 1.1}};
  const Eigen::VectorXd b{{1, 2, 3}};
  Anderson search(5);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(3);
  for (int i = 0; i < 6; ++i) x = search.next(x, a * x - b);
  EXPECT_LT((a * x - b).norm(), 1e-12);
}

// Against the search over paths, which knows nothing of transversality.
TEST(Geodesics, AMatchIsTheMinimumThatRegisterShapesFinds) {
  const CohortLaw law;
  const Points target = bent(law.q0);
  const Matched found = match(law, law.q0, target, 20);
  ASSERT_TRUE(found.match.converged);
  matching::RegistrationOptions options;
  options.kernel = law.kernel;
  options.lambda = law.lambda;
  options.sigma = law.sigma;
  options.align = AlignmentKind::kNone;
  options.minimise.gradient_tolerance = 1e-6;
  const matching::Registration other = register_shapes(shape_of(law.q0), shape_of(target), options);
  ASSERT_TRUE(other.converged);
  EXPECT_NEAR(found.cost, other.cost.total(), 1e-3 * found.cost);
  EXPECT_LT((found.match.end.q - other.result).norm(), 0.1 * law.sigma * std::sqrt(12.0));
}

// dJ/dq0 = −λp(0), by central differences of the minima.
TEST(Geodesics, TheMomentaAreTheGradientOfTheMinimumWithRespectToTheTemplate) {
  const CohortLaw law;
  const Points target = bent(law.q0);
  const Matched found = match(law, law.q0, target, 40);
  const double h = 1e-4;
  for (const auto& [axis, landmark] : {std::pair<Index, Index>(0, 3), {1, 7}, {1, 0}}) {
    Points low = law.q0, high = law.q0;
    low(axis, landmark) -= h;
    high(axis, landmark) += h;
    const double slope = (match(law, high, target, 40).cost - match(law, low, target, 40).cost) / (2 * h);
    EXPECT_NEAR(slope, -law.lambda * found.match.momenta(axis, landmark),
                1e-4 * law.lambda * found.match.momenta.cwiseAbs().maxCoeff());
  }
}

TEST(Geodesics, WithoutSigmaTheTargetIsReached) {
  CohortLaw law;
  law.sigma = 0;
  const Matched found = match(law, law.q0, bent(law.q0), 10);
  ASSERT_TRUE(found.match.converged);
  EXPECT_LT((found.match.end.q - bent(law.q0)).cwiseAbs().maxCoeff(), 2e-12);
}

// A landmark that is not observed has no momentum at the end, and what the others do determines where it goes: the
// match of the others alone costs the same.
TEST(Geodesics, AMissingLandmarkIsCarriedAlong) {
  const CohortLaw law;
  const Points target = bent(law.q0);
  std::vector<Index> observed = all_of(12);
  observed.erase(observed.begin() + 4);
  const double tau = law.lambda * law.sigma * law.sigma;
  const TemplateMetric metric(law.kernel, 0, tau, law.q0);
  const GeodesicMatch found =
      Geodesics(law.kernel, 20).match(metric, MatchModel(metric, observed), target, 0 * law.q0, 1e-12);
  ASSERT_TRUE(found.converged);
  EXPECT_LT(found.end.p.col(4).norm(), 1e-11);
  EXPECT_LT(found.momenta.col(4).norm(), 1e-11);
  CohortLaw without = law;
  without.q0 = law.q0(Eigen::all, observed);
  const Matched others = match(without, without.q0, target(Eigen::all, observed), 20);
  EXPECT_LT((found.momenta(Eigen::all, observed) - others.match.momenta).norm(), 1e-9 * others.match.momenta.norm());
}

}  // namespace
}  // namespace pulson::cohort
