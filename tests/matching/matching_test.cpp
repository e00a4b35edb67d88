#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "plain_options.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/registration.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class Objective : public testing::TestWithParam<Combination> {
 protected:
  // A matching problem of four landmarks in the plane, at a point where no term of the cost is negligible.
  Objective()
      : problem_(GetParam(), 2, 4),
        target_(problem_.start.q + 0.3 * problem_.random_state().q),
        objective_({problem_.system, make_integrator(GetParam().integrator), problem_.grid, problem_.start.q,
                    std::make_shared<LandmarkTerm>(LandmarkObservations{target_, 0.3}), 0.3, 0.7}),
        at_(objective_.evaluate(objective_.white(problem_.start.p, problem_.increments)).value()),
        direction_(problem_.numbers(objective_.unknowns(), 1)) {}

  double cost(double h) const { return objective_.evaluate(at_.z + h * direction_).value().cost.total(); }

  Problem problem_;
  Points target_;
  MatchingObjective objective_;
  MatchingObjective::Evaluation at_;
  VectorXd direction_;
};

INSTANTIATE_TEST_SUITE_P(All, Objective, testing::ValuesIn(all_combinations()),
                         [](const auto& row) { return test_name(row.param); });

TEST_P(Objective, CostIsTheFormula) {
  const Points& q0 = problem_.start.q;
  const Points p0 = objective_.momenta(at_.z);
  double energy = 0;
  for (Index a = 0; a < q0.cols(); ++a)
    for (Index b = 0; b < q0.cols(); ++b)
      energy +=
          0.35 * p0.col(a).dot(p0.col(b)) * problem_.system.kernel.jet((q0.col(a) - q0.col(b)).squaredNorm()).value;
  const double action = 0.5 * objective_.increments(at_.z).squaredNorm() / problem_.grid.dt();
  const double data = 0.5 * (at_.path().final().q - target_).squaredNorm() / (0.3 * 0.3);
  EXPECT_NEAR(at_.cost.energy, energy, 1e-12 * energy);
  EXPECT_NEAR(at_.cost.action, action, 1e-12 * action);
  EXPECT_NEAR(at_.cost.data, data, 1e-12 * data);
  EXPECT_DOUBLE_EQ(at_.cost.total(), at_.cost.energy + at_.cost.action + at_.cost.data);
  EXPECT_EQ(at_.path().initial().q, q0);
}

TEST_P(Objective, WhiteningIsUndone) {
  EXPECT_LE((objective_.momenta(at_.z) - problem_.start.p).norm(), 1e-12);
  EXPECT_LE((objective_.increments(at_.z) - problem_.increments).norm(), 1e-14);
  const VectorXd again = objective_.white(objective_.momenta(direction_), objective_.increments(direction_));
  EXPECT_LE((again - direction_).norm(), 1e-12 * direction_.norm());
  EXPECT_EQ(objective_.frequency().size(), objective_.unknowns());
}

TEST_P(Objective, GradientIsThatOfTheCost) {
  const VectorXd gradient = at_.z + objective_.data_gradient(at_);
  const MatchingObjective::Linearisation linear = objective_.linearise(at_);
  EXPECT_LE((objective_.residual(at_) - linear.residual).norm(), 1e-14 * linear.residual.norm());
  const VectorXd other = at_.z + linear.jacobian.transpose() * linear.residual;
  EXPECT_LE((gradient - other).norm(), 1e-12 * gradient.norm());
  const double slope = gradient.dot(direction_);
  const double h = 1e-5;  // errors: h² of the third derivative, and round-off of the cost over h, 1e-10 of it
  EXPECT_NEAR((cost(h) - cost(-h)) / (2 * h), slope, 1e-8 * gradient.norm() * direction_.norm());
  std::vector<double> sizes, remainders;
  for (double size = 1e-2; size > 5e-4; size /= 2) {
    sizes.push_back(size);
    remainders.push_back(std::abs(cost(size) - cost(0) - size * slope));
  }
  EXPECT_NEAR(fitted_order(sizes, remainders), 2, 0.1);
}

Landmarks on_line(std::vector<double> x) { return shape(Points::Map(x.data(), 1, static_cast<Index>(x.size()))); }

RegistrationOptions options_of(std::string kernel, std::string noise = "none", Solver solver = Solver::kAuto) {
  RegistrationOptions options = plain_options();
  options.kernel = std::move(kernel);
  options.noise = std::move(noise);
  options.minimise.solver = solver;
  return options;
}

struct Expected {
  std::string noise;
  double second_target;  // of (0,1) → (second_target, …): 0 for the exchange (1,0), 2 for the stretch (1,2)
  double total;
  double tolerance;
  bool matched;
};

// Two landmarks on a line exchange their places, which only noise in the positions can do: a prototype's costs.
class PairOnALine : public testing::TestWithParam<Expected> {};

INSTANTIATE_TEST_SUITE_P(Prototype, PairOnALine,
                         testing::Values(Expected{"ch-sd:beta=0.5", 0, 2.83, 0.01, true},
                                         Expected{"ch-sd:beta=1", 0, 0.930, 0.005, true},
                                         Expected{"ch-sd:beta=2", 0, 0.252, 0.003, true},
                                         Expected{"ch-sd:beta=1", 2, 0.421, 0.003, true},
                                         Expected{"none", 2, 0.721, 0.003, true}));

TEST_P(PairOnALine, CostsWhatThePrototypeFound) {
  const Landmarks source = on_line({0, 1});
  const Landmarks target = on_line({1, GetParam().second_target});
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    RegistrationOptions options = options_of("gaussian:alpha=1", GetParam().noise, solver);
    options.integrator = "variational";
    const Registration fit = register_shapes(source, target, options);
    SCOPED_TRACE(solver_name(solver) + ": " + fit.stop_reason);
    EXPECT_TRUE(fit.converged);
    EXPECT_TRUE(fit.matched());
    EXPECT_EQ(fit.solver, solver);
    EXPECT_NEAR(fit.cost.total(), GetParam().total, GetParam().tolerance);
    EXPECT_EQ(order_inversions(source.points, fit.result), GetParam().second_target == 0 ? 1 : 0);
  }
}

TEST(Registration, ExchangeIsPaidByTheNoise) {
  const Registration fit =
      register_shapes(on_line({0, 1}), on_line({1, 0}), options_of("gaussian:alpha=1", "ch-sd:beta=1"));
  EXPECT_EQ(fit.mode, MatchingMode::kMetamorphosis);
  EXPECT_NEAR(fit.cost.total(), 0.8132, 0.0005);  // in closed form
  EXPECT_NEAR(fit.cost.energy, 0.140, 0.005);
  EXPECT_LT(fit.rms(), 0.001);
}

// Landmarks that run into each other stop: steps too long for their momenta take them anywhere.
TEST(Registration, SharesOfAFlowThatNoStepsFollowAreNotGiven) {
  Registration fit = register_shapes(on_line({0, 1}), on_line({1, 0}), options_of("gaussian:alpha=1", "ch-sd:beta=1"));
  ASSERT_FALSE(fit.states.empty());
  const LandmarkShares shares = landmark_shares(fit);
  EXPECT_LE((shares.flow + shares.noise - (fit.result - fit.source.points)).norm(), 1e-12);
  for (const double momentum : {1.0, 3e5}) {
    fit.momenta = Eigen::RowVector2d(momentum, -momentum);
    const LandmarkShares of_strong = landmark_shares(fit);
    ASSERT_EQ(of_strong.flow.size(), momentum < 100 ? 2 : 0);
    for (const double moved : of_strong.flow.reshaped()) EXPECT_LT(std::abs(moved), 0.5);
  }
}

TEST(Registration, FlowCannotExchangeLandmarks) {
  const Registration fit = register_shapes(on_line({0, 1}), on_line({1, 0}), options_of("gaussian:alpha=1"));
  EXPECT_EQ(fit.mode, MatchingMode::kDeterministic);
  EXPECT_GT(fit.rms(), 0.4);
  EXPECT_FALSE(fit.matched());
  EXPECT_EQ(order_inversions(fit.source.points, fit.result), 0);
}

TEST(Registration, ModeDeterministicIgnoresTheNoise) {
  const Landmarks target = on_line({1, 2});
  const Registration quiet = register_shapes(on_line({0, 1}), target, options_of("gaussian:alpha=1"));
  RegistrationOptions options = options_of("gaussian:alpha=1", "ch-sd:beta=1");
  options.mode = MatchingMode::kDeterministic;
  const Registration asked = register_shapes(on_line({0, 1}), target, options);
  EXPECT_EQ(asked.result, quiet.result);
  EXPECT_EQ(asked.noise, "none");
}

TEST(Registration, SolversAgree) {
  for (const Combination& c : all_combinations()) {
    SCOPED_TRACE(c);
    Numbers numbers(5);
    const Landmarks source = shape(numbers.landmarks(2, 5));
    const Landmarks target = shape(source.points + 0.3 * numbers(2, 5));
    RegistrationOptions options = options_of(c.kernel, c.noise);
    options.integrator = c.integrator;
    options.sigma = 0.1;
    options.minimise.gradient_tolerance = 1e-5;
    options.minimise.solver = Solver::kGaussNewton;
    const Registration newton = register_shapes(source, target, options);
    options.minimise.solver = Solver::kLbfgs;
    const Registration lbfgs = register_shapes(source, target, options);
    EXPECT_TRUE(newton.converged);
    EXPECT_TRUE(lbfgs.converged) << lbfgs.stop_reason;
    // At a relative gradient of 1e-5 a cost is within 1e-10 of its minimum times the condition of the Hessian.
    EXPECT_NEAR(newton.cost.total(), lbfgs.cost.total(), 1e-6 * newton.cost.total());
  }
}

TEST(Registration, EqualShapesNeedNothing) {
  const Landmarks source = shape(Numbers(3).landmarks(2, 6));
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    for (const char* noise : {"none", "ch-sd:beta=1"}) {
      const Registration fit = register_shapes(source, source, options_of("gaussian:alpha=auto", noise, solver));
      EXPECT_TRUE(fit.converged);
      EXPECT_LE(fit.iterations, 3);  // one look of the search for the start, and one from each of two starts
      EXPECT_EQ(fit.momenta.norm(), 0);
      EXPECT_EQ(fit.increments.norm(), 0);
      EXPECT_EQ(fit.cost.total(), 0);
      EXPECT_EQ(fit.result, source.points);
    }
  }
}

// J does not change where lengths, α, β and σ are multiplied by s and λ by 1/s², nor where T is multiplied by c, β by
// 1/√c and λ by c². With powers of 2 (4 for c) every operation scales without rounding, so all bits are the same.
TEST(Registration, UnitsOfLengthAndTimeChangeNothing) {
  Numbers numbers(7);
  const Points q0 = numbers.landmarks(2, 5);
  const Points y = q0 + 0.3 * numbers(2, 5);
  const auto fit = [&](double s, double c, Solver solver) {
    RegistrationOptions options = options_of("gaussian:alpha=" + std::to_string(0.5 * s),
                                             "ch-sd:beta=" + std::to_string(s / std::sqrt(c)), solver);
    options.grid = {c, 10};
    options.sigma = s / 64;
    options.lambda = c * c / (s * s);
    return register_shapes(shape(s * q0), shape(s * y), options);
  };
  for (const Solver solver : {Solver::kGaussNewton, Solver::kLbfgs}) {
    const Registration one = fit(1, 1, solver);
    const Registration large = fit(8, 1, solver);
    const Registration slow = fit(1, 4, solver);
    EXPECT_EQ(large.cost.total(), one.cost.total());
    EXPECT_EQ(large.momenta, 8 * one.momenta);
    EXPECT_EQ(large.increments, one.increments);
    EXPECT_EQ(large.result, 8 * one.result);
    EXPECT_EQ(slow.cost.total(), one.cost.total());
    EXPECT_EQ(slow.momenta, one.momenta / 4);
    EXPECT_EQ(slow.increments, 2 * one.increments);
    EXPECT_EQ(slow.result, one.result);
  }
}

// 400 landmarks: enough pairs for the kernel sums to be shared out over threads.
TEST(Registration, IsTheSameForAnyNumberOfThreads) {
  Numbers numbers(9);
  const Landmarks source = shape(numbers.landmarks(1, 400));
  const Landmarks target = shape(source.points + 0.05 * numbers(1, 400));
  RegistrationOptions options = options_of("gaussian:alpha=0.9", "ch-sd:beta=1", Solver::kLbfgs);
  options.grid = {1, 4};
  options.sigma = 0.1;
  options.minimise.max_iterations = 10;
  std::vector<Registration> fits;
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    fits.push_back(register_shapes(source, target, options));
  }
  set_thread_count(0);
  for (const Registration& fit : fits) {
    EXPECT_EQ(fit.result, fits[0].result);
    EXPECT_EQ(fit.momenta, fits[0].momenta);
    EXPECT_EQ(fit.increments, fits[0].increments);
    EXPECT_EQ(fit.cost.total(), fits[0].cost.total());
  }
}

TEST(Registration, CountsOrderInversions) {
  const auto count = [](std::vector<double> before, std::vector<double> after) {
    return order_inversions(on_line(std::move(before)).points, on_line(std::move(after)).points);
  };
  EXPECT_EQ(count({0, 1, 2}, {5, 6, 7}), 0);
  EXPECT_EQ(count({0, 1, 2}, {1, 0, 2}), 1);
  EXPECT_EQ(count({2, 0, 1}, {-2, 0, -1}), 3);
  EXPECT_EQ(count({0}, {1}), 0);
}

}  // namespace
}  // namespace pulson::matching
