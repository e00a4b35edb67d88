#include "matching/maximum.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

namespace pulson::matching {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// −½ (x − m)ᵀA(x − m) with m = (1, −2)
const MatrixXd kInformation{{4, 1.5}, {1.5, 1}};
const VectorXd kMiddle{{1, -2}};
double quadratic(const VectorXd& x) { return -0.5 * (x - kMiddle).dot(kInformation * (x - kMiddle)); }
SecondOrder exact_model(const VectorXd& x) { return {quadratic(x), -kInformation * (x - kMiddle), kInformation}; }

Box square(double half) { return {VectorXd::Constant(2, -half), VectorXd::Constant(2, half)}; }

TEST(Maximise, FindsTheMaximumPastAWall) {
  int beyond = 0;
  const auto f = [&](const VectorXd& x) {
    if (x[0] < -0.2 || x[1] < -2.1) {
      ++beyond;
      return -std::numeric_limits<double>::infinity();
    }
    return 5 + quadratic(x);
  };
  const Maximum found = maximise(f, square(3), VectorXd::Zero(2), {.first_step = 1});
  EXPECT_TRUE(found.converged);
  EXPECT_GT(beyond, 0);
  EXPECT_LE((found.x - kMiddle).norm(), 1e-3);
  EXPECT_NEAR(found.value, 5, 1e-5);
  EXPECT_FALSE(found.at_bound.any());
}

TEST(Maximise, EndsAtABoundToWhichTheFunctionRises) {
  const auto f = [](const VectorXd& x) { return 10 * x[0] - 2 * std::pow(x[1] - 0.5 * x[0], 2); };
  const Maximum found = maximise(f, square(1), VectorXd::Zero(2));
  EXPECT_TRUE(found.at_bound[0]);
  EXPECT_FALSE(found.at_bound[1]);
  EXPECT_NEAR(found.x[0], 1, 1e-12);
  EXPECT_NEAR(found.x[1], 0.5, 1e-3);
}

TEST(Maximise, HoldsNumbersWhoseBoundsAreEqual) {
  Box box = square(9);
  box.least[0] = box.most[0] = 0.5;
  const Maximum held = maximise(quadratic, box, VectorXd{{0.5, 0}});
  EXPECT_EQ(held.x[0], 0.5);
  EXPECT_NEAR(held.x[1], -2 + 1.5 * 0.5, 1e-3);  // the best with the other held
  box.least[1] = box.most[1] = 3;
  const Maximum all_held = maximise_from_grid(quadratic, box, {1, 1});
  EXPECT_EQ(all_held.x, (VectorXd{{0.5, 3}}));
  EXPECT_TRUE(all_held.converged);
  EXPECT_EQ(all_held.evaluations, 1);
}

TEST(Maximise, EndsWhereTheEvaluationsDo) {
  const Maximum found = maximise(quadratic, square(9), VectorXd::Zero(2), {.max_evaluations = 6});
  EXPECT_FALSE(found.converged);
  EXPECT_LE(found.evaluations, 6);
  EXPECT_EQ(found.value, quadratic(found.x));
}

TEST(Maximise, PassesOnWhatTheFunctionThrows) {
  const auto f = [](const VectorXd& x) -> double {
    if (x[0] > 0.1) throw std::domain_error("of f");
    return x[0];
  };
  EXPECT_THROW(maximise(f, square(1), VectorXd::Zero(2)), std::domain_error);
}

TEST(Maximise, IsNotConvergedWhereTheStartHasNoValue) {
  const auto f = [](const VectorXd&) { return std::nan(""); };
  EXPECT_FALSE(maximise(f, square(1), VectorXd::Zero(2)).converged);
  EXPECT_FALSE(maximise_from_grid(f, square(1), {3, 3}).converged);
}

// sin x − (x − 6)²/10, whose maxima are near 1.8 and 7.6.
TEST(MaximiseFromGrid, FindsTheGreatestOfSeveralMaximaInOneNumber) {
  const auto f = [](const VectorXd& x) { return std::sin(x[0]) - 0.1 * std::pow(x[0] - 6, 2); };
  const Maximum found = maximise_from_grid(f, {VectorXd{{0}}, VectorXd{{9}}}, {7});
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(std::cos(found.x[0]) - 0.2 * (found.x[0] - 6), 0, 2e-4);
  EXPECT_GT(found.x[0], 6);
  EXPECT_LE(found.evaluations, 7 + 20);
}

TEST(SecondOrder, IsExactForQuadraticsOneByOneAndAtOnce) {
  const VectorXd x{{0.3, 0.4}};
  for (const bool at_once : {false, true}) {
    const SecondOrder here = second_order(quadratic, x, 0.1, at_once);
    EXPECT_EQ(here.value, quadratic(x));
    EXPECT_LE((here.gradient - exact_model(x).gradient).norm(), 1e-12);
    EXPECT_LE((here.information - kInformation).norm(), 1e-11);
  }
}

TEST(MaximiseByNewton, FindsTheMaximumInsideAndAtABound) {
  const NewtonMaximum inside = maximise_by_newton(quadratic, exact_model, square(9), VectorXd{{0, 0}});
  EXPECT_TRUE(inside.converged);
  EXPECT_LE((inside.x - kMiddle).norm(), 1e-6);
  Box narrow = square(9);
  narrow.least[1] = -1;
  const NewtonMaximum bound = maximise_by_newton(quadratic, exact_model, narrow, VectorXd{{0, 0}});
  EXPECT_NEAR(bound.x[1], -1, 1e-12);
  EXPECT_NEAR(bound.x[0], 1 - 1.5 / 4, 1e-6);  // the best with the other held
  EXPECT_EQ(bound.about.value, quadratic(bound.x));
  const NewtonMaximum after_one =
      maximise_by_newton(quadratic, exact_model, narrow, VectorXd{{0, 0}}, {.longest_step = 9, .most_steps = 1});
  EXPECT_LE((after_one.x - bound.x).norm(), 1e-6) << "in one step, as of any quadratic";
}

// A model of the wrong sign promises a gain that no step has.
TEST(MaximiseByNewton, IsNotConvergedWhereNoStepRises) {
  const auto wrong = [](const VectorXd& x) {
    return SecondOrder{quadratic(x), kInformation * (x - kMiddle), kInformation};
  };
  const NewtonMaximum found = maximise_by_newton(quadratic, wrong, square(9), VectorXd{{0, 0}});
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.x, VectorXd::Zero(2));
  EXPECT_GT(found.gain, 0.1);
}

}  // namespace
}  // namespace pulson::matching
