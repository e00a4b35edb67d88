// Recorded momenta against a flow of their own, and searches that are interrupted.

#include "shootable_momenta.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "geodesic_search.hpp"
#include "path_examples.hpp"
#include "settling.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

constexpr double kRingAlpha = 0.6, kRingSigma = 0.002, kRingBeta = 0.1;

Points unit_circle(Index n) {
  const Eigen::ArrayXd t =
      2 * std::numbers::pi / static_cast<double>(n) * Eigen::ArrayXd::LinSpaced(n, 0, static_cast<double>(n - 1));
  Points q(2, n);
  q << t.cos().matrix().transpose(), t.sin().matrix().transpose();
  return q;
}

// Stretched, with a bump of a quarter of the radius.
Points bumpy_ellipse(const Points& circle) {
  Points target = circle;
  for (Index a = 0; a < circle.cols(); ++a) {
    const double angle = std::atan2(circle(1, a), circle(0, a)) - 1;
    const double radius = 1 + 0.25 * std::exp(-8 * angle * angle);
    target.col(a) = radius * circle.col(a).cwiseProduct(Eigen::Vector2d(1.3, 1 / 1.3));
  }
  return target;
}

RegistrationOptions metamorphosis_options(int steps) {
  RegistrationOptions options;
  options.kernel = "gaussian:alpha=0.6";
  options.sigma = kRingSigma;
  options.lambda = 1.0;
  options.noise = ch_sd(kRingBeta);
  options.grid.steps = steps;
  options.align = AlignmentKind::kNone;
  return options;
}

struct TotalRates {
  Points q, p;
  double energy = 0;  // H_tot
};

// H_tot = ½ Σ_ab p_a·p_b exp(−|q_a − q_b|²/α²) + ½β²|p|², with λ = 1.
TotalRates total_rates(const Points& q, const Points& p) {
  const Eigen::VectorXd squares = q.colwise().squaredNorm();
  Eigen::MatrixXd distances = -2 * q.transpose() * q;
  distances.colwise() += squares;
  distances.rowwise() += squares.transpose();
  const Eigen::MatrixXd gram = (-distances.array() / (kRingAlpha * kRingAlpha)).exp();
  const Eigen::MatrixXd pulls = (p.transpose() * p).cwiseProduct(gram);
  const Eigen::VectorXd total = pulls.rowwise().sum();
  TotalRates made{p * gram + kRingBeta * kRingBeta * p,
                  2 / (kRingAlpha * kRingAlpha) * (q * total.asDiagonal() - q * pulls), 0};
  made.energy = 0.5 * p.cwiseProduct(made.q).sum();
  return made;
}

Points end_of_own_shot(const Points& q0, const Points& p0, int steps) {
  Points q = q0, p = p0;
  const double h = 1.0 / steps;
  for (int k = 0; k < steps; ++k) {
    const TotalRates a = total_rates(q, p), b = total_rates(q + h / 2 * a.q, p + h / 2 * a.p),
                     c = total_rates(q + h / 2 * b.q, p + h / 2 * b.p), e = total_rates(q + h * c.q, p + h * c.p);
    q += h / 6 * (a.q + 2 * b.q + 2 * c.q + e.q);
    p += h / 6 * (a.p + 2 * b.p + 2 * c.p + e.p);
  }
  return q;
}

// Few landmarks, whose path is searched for by its action, and more than 300, for which its equations are solved.
class ShootableMomentaOf : public testing::TestWithParam<Index> {};
INSTANTIATE_TEST_SUITE_P(Landmarks, ShootableMomentaOf, testing::Values(40, 310));

TEST_P(ShootableMomentaOf, EndWhereThePathDoesAndCostTheSame) {
  const Points source = unit_circle(GetParam()), target = bumpy_ellipse(source);
  const Registration found = register_shapes(shape(source), shape(target), metamorphosis_options(10));
  ASSERT_TRUE(found.converged) << found.stop_reason;
  const Points end = end_of_own_shot(source, found.momenta, 20 * found.grid.steps);
  EXPECT_LE(rms_distance(end, found.result), 0.1 * kRingSigma);
  const double data = 0.5 * (end - target).squaredNorm() / (kRingSigma * kRingSigma);
  const double cost = found.cost.total();
  EXPECT_NEAR(total_rates(source, found.momenta).energy + data, cost, 5e-3 * cost);
  ASSERT_TRUE(found.step_error);
  EXPECT_NEAR(found.step_error->cost, total_rates(source, found.momenta).energy + data - cost, 1e-4 * cost);
  // Those of the midpoint rule do not.
  const Points off = end_of_own_shot(source, found.states.front().p, 20 * found.grid.steps);
  EXPECT_GT(0.5 * (off - target).squaredNorm() / (kRingSigma * kRingSigma), 1e-2 * cost);
}

TEST(ShootableMomenta, CostWhatThoseOfManyStepsDo) {
  const Points source = unit_circle(40), target = bumpy_ellipse(source);
  const Registration found = register_shapes(shape(source), shape(target), metamorphosis_options(20));
  const Registration fine = register_shapes(shape(source), shape(target), metamorphosis_options(80));
  EXPECT_NEAR(found.cost.total(), fine.cost.total(), 5e-3 * fine.cost.total());
}

// Landmarks that are not observed are where the path has them, too.
TEST(ShootableMomenta, AreOfEveryLandmark) {
  const Points source = unit_circle(40);
  RegistrationOptions options = metamorphosis_options(10);
  options.data.weights = Eigen::VectorXd::Ones(40);
  options.data.weights.segment(3, 5).setZero();
  const Registration found = register_shapes(shape(source), shape(bumpy_ellipse(source)), options);
  EXPECT_LE(rms_distance(end_of_own_shot(source, found.momenta, 200), found.result), 1e-2 * kRingSigma);
}

// A strip bent into a U, whose path amplifies errors three thousandfold.
TEST(ShootableMomenta, AreThoseOfThePathWhereItCannotBeShot) {
  Points source(2, 52), target(2, 52);
  for (Index a = 0; a < 52; ++a) {
    source.col(a) << 3 * static_cast<double>(a / 4) / 12 - 1.5, 0.5 * static_cast<double>(a % 4) / 3 - 0.25;
    const double angle = std::numbers::pi / 2 * (2 - source(0, a) / 1.5), radius = 3 / std::numbers::pi + source(1, a);
    target.col(a) << radius * std::cos(angle), radius * std::sin(angle);
  }
  RegistrationOptions options = metamorphosis_options(20);
  options.noise = "none";
  options.kernel = "gaussian:alpha=0.9";
  options.sigma = 0.003;
  const Registration found = register_shapes(shape(source), shape(target), options);
  EXPECT_TRUE(found.converged) << found.stop_reason;
  EXPECT_EQ(found.integrator, "midpoint");
  ASSERT_EQ(found.states.size(), 21U);
  EXPECT_EQ(found.states.back().q, found.result);
  const StochasticSystem system = registration_system(found);
  for (std::size_t k = 0; k < 20; ++k) {  // its own states obey the midpoint rule
    const PhaseState &from = found.states[k], &to = found.states[k + 1];
    const Flow flow = system.kernel.flow(0.5 * (from.q + to.q), 0.5 * (from.p + to.p));
    EXPECT_LE(rms_distance(to.q, from.q + found.grid.dt() * flow.velocity), 1e-2 * found.sigma) << k;
    EXPECT_LE((to.p - from.p + found.grid.dt() * flow.force).norm(), 1e-3 * from.p.norm()) << k;
  }
}

TEST(InterruptedSearch, EndsWithTheBestPath) {
  const Points source = unit_circle(40), target = bumpy_ellipse(source);
  const double at_rest = 0.5 * (source - target).squaredNorm() / (kRingSigma * kRingSigma);
  for (const std::string& noise : {ch_sd(kRingBeta), std::string("none")}) {
    RegistrationOptions options = metamorphosis_options(10);
    options.noise = noise;
    int iterations = 0;
    options.minimise.on_iteration = [&](int, double, double) { ++iterations; };
    options.minimise.interrupted = [&] { return iterations >= 6; };
    const Registration found = register_shapes(shape(source), shape(target), options);
    EXPECT_FALSE(found.converged);
    EXPECT_EQ(found.stop_reason, "interrupted");
    EXPECT_LT(found.cost.total(), 0.1 * at_rest) << noise;
    EXPECT_LT(iterations, 10);
    EXPECT_EQ(replay(found).final().q, found.result);
  }
}

TEST(InterruptedSearch, EndsInShootingToo) {
  const Points source = unit_circle(12), target = bumpy_ellipse(source);
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    RegistrationOptions options = metamorphosis_options(10);
    options.minimise.solver = solver;
    options.minimise.interrupted = [] { return true; };
    const Registration found = register_shapes(shape(source), shape(target), options);
    EXPECT_FALSE(found.converged);
    EXPECT_EQ(found.stop_reason, "interrupted");
  }
}

}  // namespace
}  // namespace pulson::matching
