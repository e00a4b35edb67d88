// The surfaces by which the evidence is searched, and the intervals from them.

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "evidence_map.hpp"
#include "profile.hpp"
#include "response_surface.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// −½ (x − m)ᵀA(x − m) with m = (1, −2)
const MatrixXd kInformation{{4, 1.5}, {1.5, 1}};
const VectorXd kMiddle{{1, -2}};
double quadratic(const VectorXd& x) { return -0.5 * (x - kMiddle).dot(kInformation * (x - kMiddle)); }
SecondOrder second_order(const VectorXd& x) { return {-kInformation * (x - kMiddle), kInformation}; }

MatrixXd places() {
  MatrixXd places(2, 9);
  places << 0, 1, 2, 0, 1, 2, 0, 1, 2.5, -3, -3, -3, -2, -2, -2, -1, -1, -1;
  return places;
}

TEST(ResponseSurface, IsTheQuadraticThroughItsValues) {
  const MatrixXd at = places();
  VectorXd values(at.cols());
  for (Index k = 0; k < at.cols(); ++k) values[k] = quadratic(at.col(k));
  const ResponseSurface surface(at, values, kInformation);
  const VectorXd x{{0.3, -1.4}};
  EXPECT_NEAR(surface(x), quadratic(x), 1e-10);
  EXPECT_LE((surface.second_order(x).gradient - second_order(x).gradient).norm(), 1e-9);
  EXPECT_LE((surface.second_order(x).information - kInformation).norm(), 1e-9);
}

TEST(ResponseSurface, PassesThroughAnyValuesWithItsOwnDerivatives) {
  const MatrixXd at = places();
  const VectorXd values = (0.3 * at.row(0).array()).exp() * (0.5 * at.row(1).array()).sin();
  const ResponseSurface surface(at, values, kInformation);
  for (Index k = 0; k < at.cols(); ++k) EXPECT_NEAR(surface(at.col(k)), values[k], 1e-9);
  const VectorXd x{{0.3, -1.4}};
  EXPECT_NEAR(surface(x), std::exp(0.3 * x[0]) * std::sin(0.5 * x[1]), 0.02);
  const double h = 1e-4;
  const SecondOrder here = surface.second_order(x);
  for (Index i = 0; i < 2; ++i) {
    const VectorXd step = h * VectorXd::Unit(2, i);
    EXPECT_NEAR(here.gradient[i], (surface(x + step) - surface(x - step)) / (2 * h), 1e-6);
    const VectorXd bend = (surface.second_order(x + step).gradient - surface.second_order(x - step).gradient) / (2 * h);
    EXPECT_LE((here.information.col(i) + bend).norm(), 1e-6);
  }
}

// With errors of ±0.3 about a quadratic whose values within a deviation differ by less than ½, a surface through them
// has maxima between its places.
TEST(ResponseSurface, IsNearValuesWithErrors) {
  MatrixXd at(2, 25);
  VectorXd values(25), exact(25);
  for (Index k = 0; k < 25; ++k) {
    at.col(k) = VectorXd{{0.5 * static_cast<double>(k % 5 - 2), 0.5 * static_cast<double>(k / 5 - 2)}};
    exact[k] = -0.5 * at.col(k).squaredNorm();
    values[k] = exact[k] + 0.3 * std::sin(40.0 * static_cast<double>(k * k));
  }
  const MatrixXd metric = MatrixXd::Identity(2, 2);
  const ResponseSurface through(at, values, metric), near(at, values, metric, VectorXd::Ones(25));
  const auto error = [&](const ResponseSurface& surface) {
    double sum = 0;
    for (Index k = 0; k < 25; ++k) sum += std::pow(surface(at.col(k)) - exact[k], 2);
    return std::sqrt(sum / 25);
  };
  EXPECT_GT(error(through), 0.18);
  EXPECT_LT(error(near), 0.12);
  EXPECT_NEAR(near.second_order(VectorXd::Zero(2)).information(0, 0), 1, 0.3);
  // Without errors it is as good as through them.
  VectorXd bent(25);
  for (Index k = 0; k < 25; ++k) bent[k] = std::exp(at(0, k)) * std::cos(at(1, k));
  const ResponseSurface smooth(at, bent, metric, VectorXd::Ones(25));
  EXPECT_NEAR(smooth(VectorXd{{0.3, 0.2}}), std::exp(0.3) * std::cos(0.2), 0.02);
}

// Nothing can be left out to choose how smooth it is.
TEST(ResponseSurface, PassesThroughAsManyValuesAsItsPolynomialHas) {
  const MatrixXd metric = MatrixXd::Identity(2, 2);
  for (const Index count : {1, 2, 3, 6}) {
    const MatrixXd at = MatrixXd{{0, 1, 0, 2, 1, 0}, {0, 0, 1, 0, 1, 2}}.leftCols(count);
    const VectorXd values = VectorXd{{3, 1, -2, 4, 0.5, 7}}.head(count);
    const ResponseSurface near(at, values, metric, VectorXd::Constant(count, 1e-9));
    EXPECT_TRUE(std::isfinite(near(VectorXd{{0.3, 0.4}})));
    if (count == 2) continue;  // a constant
    for (Index k = 0; k < count; ++k) EXPECT_NEAR(near(at.col(k)), values[k], 1e-6) << count;
  }
}

// One number never varies, so that no quadratic is determined.
TEST(ResponseSurface, OfPlacesOnALineIsFlatAcrossIt) {
  MatrixXd at(2, 4);
  at << 0, 1, 2, 3, 5, 5, 5, 5;
  const ResponseSurface surface(at, VectorXd{{0, 1, 4, 9}}, MatrixXd::Identity(2, 2));
  EXPECT_NEAR(surface(VectorXd{{2, 5}}), 4, 1e-9);
  EXPECT_TRUE(std::isfinite(surface(VectorXd{{2, 6}})));
}

TEST(MaximiseInBox, FindsTheMaximumInsideAndAtABound) {
  const Box wide{VectorXd{{-9, -9}}, VectorXd{{9, 9}}};
  const BoxMaximum inside = maximise_in_box(quadratic, second_order, wide, VectorXd{{0, 0}});
  EXPECT_TRUE(inside.converged);
  EXPECT_LE((inside.x - kMiddle).norm(), 1e-6);
  const Box narrow{VectorXd{{-9, -1}}, VectorXd{{9, 9}}};
  const BoxMaximum bound = maximise_in_box(quadratic, second_order, narrow, VectorXd{{0, 0}});
  EXPECT_NEAR(bound.x[1], -1, 1e-12);
  EXPECT_NEAR(bound.x[0], 1 - 1.5 / 4, 1e-6);  // the best with the other held
  NewtonOptions one_step;
  one_step.most_steps = 1;
  one_step.longest_step = 9;
  const BoxMaximum after_one = maximise_in_box(quadratic, second_order, narrow, VectorXd{{0, 0}}, one_step);
  EXPECT_LE((after_one.x - bound.x).norm(), 1e-6) << "in one step, as of any quadratic";
}

TEST(ProfileEnd, OfAQuadraticIsTheMarginalDeviation) {
  const Likelihood likelihood{quadratic, second_order, {VectorXd{{-99, -99}}, VectorXd{{99, 99}}}, kMiddle};
  const MatrixXd covariance = kInformation.inverse();
  for (const Index i : {0, 1})
    for (const int direction : {-1, 1}) {
      const double deviation = std::sqrt(covariance(i, i));
      const auto end = profile_end(likelihood, i, direction, deviation, [](double) { return kDropOfNinety; });
      EXPECT_FALSE(end.is_beyond);
      EXPECT_NEAR(end.place[i], kMiddle[i] + direction * 1.64485 * deviation, 2e-3 * deviation);
    }
}

TEST(ProfileEnd, IsThatOfTheBoxWhereTheProfileEndsBeyond) {
  const Likelihood likelihood{quadratic, second_order, {VectorXd{{0.9, -99}}, VectorXd{{99, 99}}}, kMiddle};
  const ProfileEnd end = profile_end(likelihood, 0, -1, 1, [](double) { return kDropOfNinety; });
  EXPECT_TRUE(end.is_beyond);
  EXPECT_DOUBLE_EQ(end.place[0], 0.9);
}

// Two peaks of deviations 1 at 0 and 10, the latter lower by less than 1.35, with a valley between.
TEST(ProfileEnd, IsThatOfTheFartherPeakWhereThatIsLikelyToo) {
  const auto of_peaks = [](double lower) {
    const auto log_sum = [lower](double x) {
      return std::log(std::exp(-0.5 * x * x) + std::exp(-0.5 * (x - 10) * (x - 10) - lower));
    };
    return Likelihood{[=](const VectorXd& x) { return log_sum(x[0]); },
                      [=](const VectorXd& x) {
                        constexpr double kStep = 1e-4;
                        const double up = log_sum(x[0] + kStep), here = log_sum(x[0]), down = log_sum(x[0] - kStep);
                        return SecondOrder{VectorXd::Constant(1, (up - down) / (2 * kStep)),
                                           MatrixXd::Constant(1, 1, -(up - 2 * here + down) / (kStep * kStep))};
                      },
                      {VectorXd::Constant(1, -99), VectorXd::Constant(1, 99)},
                      VectorXd::Zero(1)};
  };
  const auto drop = [](double) { return kDropOfNinety; };
  const std::vector<VectorXd> others = {VectorXd::Constant(1, 10.2)};
  EXPECT_NEAR(profile_end(of_peaks(1), 0, 1, 1, drop).place[0], 1.64485, 2e-3);
  EXPECT_NEAR(profile_end(of_peaks(1), 0, 1, 1, drop, others).place[0], 10 + std::sqrt(2 * (kDropOfNinety - 1)), 2e-3);
  EXPECT_NEAR(profile_end(of_peaks(1), 0, -1, 1, drop, others).place[0], -1.64485, 2e-3);
  EXPECT_NEAR(profile_end(of_peaks(2), 0, 1, 1, drop, others).place[0], 1.64485, 2e-3);
}

// An estimate that would be N(d, 1) were there no bound at 0: the likelihood ratio of the truth d over a grid of 2e5
// quantiles.
TEST(DropOfNinety, CoversNinetyPerCentAtAnyDistanceFromABound) {
  EXPECT_NEAR(2 * drop_of_ninety(0), 1.6424, 1e-3);
  EXPECT_DOUBLE_EQ(drop_of_ninety(5), kDropOfNinety);
  for (const double d : {0.0, 0.3, 0.8, 1.2, 1.6, 2.0}) {
    constexpr double kStep = 1e-4;
    double covered = 0;
    for (double z = -8; z < 8; z += kStep) {
      const double seen = d + z;
      const double best = std::max(seen, 0.0);
      const double drop = 0.5 * ((seen - d) * (seen - d) - (seen - best) * (seen - best));
      if (drop <= drop_of_ninety(d)) covered += kStep * std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
    }
    EXPECT_NEAR(covered, 0.9, 1e-3) << d;
  }
}

TEST(SumOfLogMeans, LeavesOutAGroup) {
  const VectorXd logs = VectorXd::LinSpaced(16, 0, 1.5);
  const std::vector<VectorXd> two{logs, logs};
  EXPECT_NEAR(sum_of_log_means(two), 2 * sum_of_log_means({logs}), 1e-12);
  VectorXd without(14);
  without << logs.segment(0, 3), logs.segment(4, 7), logs.tail(4);
  EXPECT_NEAR(sum_of_log_means({logs}, 3), sum_of_log_means({without}), 1e-12);
  const VectorXd alike = VectorXd::Constant(16, 2.5);
  EXPECT_NEAR(sum_of_log_means({alike}), 2.5, 1e-12);
}

}  // namespace
}  // namespace pulson::compare
