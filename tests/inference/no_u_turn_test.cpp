// The no-U-turn sampler against quadrature, where the force is far from that of the normal law.

#include "inference/no_u_turn.hpp"

#include <cmath>
#include <functional>
#include <optional>

#include <gtest/gtest.h>

#include "inference/normal_quantile.hpp"
#include "pulson/inference/diagnostics.hpp"
#include "random/normals.hpp"

namespace pulson::inference {
namespace {

using Eigen::VectorXd;

constexpr int kMostDoublings = 6;

// log w = −¼ (v₁⁴ + v₂⁴) + 2 v₁
double log_weight(const VectorXd& v) { return -0.25 * v.array().pow(4).sum() + 2 * v[0]; }

VectorXd force(const VectorXd& v) {
  VectorXd gradient = -v.array().cube();
  gradient[0] += 2;
  return gradient;
}

TrajectoryPoint point(VectorXd v, VectorXd eta) {
  TrajectoryPoint made;
  made.at.v = std::move(v);
  made.at.weight.value = log_weight(made.at.v);
  made.eta = std::move(eta);
  made.kick = force(made.at.v);
  made.energy = -made.at.weight.value + 0.5 * made.at.v.squaredNorm() + 0.5 * made.eta.squaredNorm();
  return made;
}

TrajectoryPoint step(const TrajectoryPoint& from, double angle) {
  const VectorXd half = from.eta + 0.5 * angle * from.kick;
  TrajectoryPoint to = point(std::cos(angle) * from.at.v + std::sin(angle) * half, half);
  const VectorXd turned = std::cos(angle) * half - std::sin(angle) * from.at.v;
  return point(to.at.v, turned + 0.5 * angle * to.kick);
}

// ∫ f(x) e^(−½x² − ¼x⁴ + bx) dx over that of 1.
double mean_of(const std::function<double(double)>& f, double b) {
  double mass = 0, sum = 0;
  for (double x = -6; x <= 6; x += 1e-3) {
    const double density = std::exp(-0.5 * x * x - 0.25 * x * x * x * x + b * x);
    mass += density;
    sum += f(x) * density;
  }
  return sum / mass;
}

// Steps so long that a fifth of the points would be rejected.
TEST(NoUTurn, DrawsFromTheDensity) {
  constexpr int kDraws = 20000;
  Eigen::MatrixXd first(kDraws, 1), squares(kDraws, 1), second(kDraws, 1);
  VectorXd v = VectorXd::Zero(2);
  double acceptance = 0;
  for (int i = 0; i < kDraws; ++i) {
    const auto path = static_cast<std::uint64_t>(i);
    const VectorXd uniforms = standard_normals(1, path, 2 << kMostDoublings, 1).unaryExpr(&normal_probability);
    NoUTurn trajectory([](const TrajectoryPoint& from, int direction) { return step(from, 0.7 * direction); }, uniforms,
                       kMostDoublings);
    v = trajectory.draw(point(v, standard_normals(2, path, 2, 1))).v;
    acceptance += trajectory.acceptance() / kDraws;
    first(i, 0) = v[0];
    squares(i, 0) = v[0] * v[0];
    second(i, 0) = v[1] * v[1];
  }
  EXPECT_LT(acceptance, 0.95);
  const auto expect_mean = [](const Eigen::MatrixXd& draws, double mean) {
    const DrawSummary summary = summarise(draws);
    EXPECT_NEAR(summary.mean, mean, 3 * summary.mcse);
    EXPECT_LT(summary.mcse, 0.01);
  };
  expect_mean(first, mean_of([](double x) { return x; }, 2));
  expect_mean(squares, mean_of([](double x) { return x * x; }, 2));
  expect_mean(second, mean_of([](double x) { return x * x; }, 0));
}

// Without a force a trajectory goes half around the circle, in steps of a tenth of that, and is doubled no further.
TEST(NoUTurn, EndsWhereTheTrajectoryTurns) {
  int steps = 0;
  const auto turned = [&](const TrajectoryPoint& from, int direction) {
    ++steps;
    TrajectoryPoint to = from;
    const double angle = direction * 3.14159265 / 10;
    to.at.v = std::cos(angle) * from.at.v + std::sin(angle) * from.eta;
    to.eta = std::cos(angle) * from.eta - std::sin(angle) * from.at.v;
    return std::optional(to);
  };
  TrajectoryPoint start;
  start.at.v = VectorXd{{1, 0}};
  start.eta = VectorXd{{0, 1}};
  start.energy = 1;
  NoUTurn trajectory(turned, VectorXd::Constant(2 << kMostDoublings, 0.6), kMostDoublings);
  trajectory.draw(start);
  EXPECT_EQ(steps, 15);
  EXPECT_DOUBLE_EQ(trajectory.acceptance(), 1);
}

}  // namespace
}  // namespace pulson::inference
