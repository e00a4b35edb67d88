// Losses: their weights, constants and scales, against formulas and integrals of their own.

#include "pulson/matching/robust_loss.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "error_of.hpp"

namespace pulson::matching {
namespace {

constexpr std::array kKinds = {LossKind::kStudent, LossKind::kHuber, LossKind::kCauchy, LossKind::kTukey};

// w(r) and dw/dr, in units of w(0), as in the textbooks.
std::pair<double, double> weight_and_slope(LossKind kind, double k, double r) {
  switch (kind) {
    case LossKind::kStudent:
      return {k / (k + r * r), -2 * r * k / std::pow(k + r * r, 2)};
    case LossKind::kHuber:
      return r <= k ? std::pair(1.0, 0.0) : std::pair(k / r, -k / (r * r));
    case LossKind::kCauchy:
      return {1 / (1 + r * r / (k * k)), -2 * r / (k * k) / std::pow(1 + r * r / (k * k), 2)};
    case LossKind::kTukey:
      break;
  }
  const double left = 1 - r * r / (k * k);
  return r <= k ? std::pair(left * left, -4 * r / (k * k) * left) : std::pair(0.0, 0.0);
}

// E f(|x|) of x ~ N(0, I) in R^d, by midpoints.
template <class Function>
double normal_mean(int d, const Function& f) {
  constexpr int kPoints = 20000;
  constexpr double kFarthest = 10;
  const double surface = 2 * std::pow(std::numbers::pi, 0.5 * d) / std::tgamma(0.5 * d);
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double r = (i + 0.5) * kFarthest / kPoints;
    sum += f(r) * surface * std::pow(r, d - 1) * std::exp(-r * r / 2) / std::pow(2 * std::numbers::pi, 0.5 * d);
  }
  return sum * kFarthest / kPoints;
}

// With residuals r/s: of an M-estimator (E div ψ/d)² over E|ψ|²/d, that of the mean being 1.
double efficiency(LossKind kind, double k, double s, int d) {
  const double divergence = normal_mean(d, [&](double r) {
    const auto [w, slope] = weight_and_slope(kind, k, r / s);
    return w + r / s * slope / d;
  });
  const double square =
      normal_mean(d, [&](double r) { return std::pow(weight_and_slope(kind, k, r / s).first * r, 2) / d; });
  return divergence * divergence / square;
}

// Student's scale of greatest likelihood for normal data: the mean of (ν + d)/ν w(r/s) (r/s)² is d.
double student_scale(double nu, int d) {
  double low = 0.3, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double s = 0.5 * (low + high);
    const double mean =
        normal_mean(d, [&](double r) { return (nu + d) / (nu + std::pow(r / s, 2)) * std::pow(r / s, 2); });
    (mean > d ? low : high) = s;
  }
  return low;
}

TEST(RobustLoss, EfficiencyIs95PerCent) {
  for (int d = 1; d <= 3; ++d)
    for (const LossKind kind : kKinds) {
      const double k = efficient_constant(kind, d);
      // Midpoints miss the jump of Huber's dw/dr by up to half of a step.
      EXPECT_NEAR(efficiency(kind, k, kind == LossKind::kStudent ? student_scale(k, d) : 1, d), 0.95, 2e-4)
          << loss_spec({kind, k}, d) << " in " << d << "D";
    }
}

TEST(RobustLoss, WeightsAreTheTextbooksAndConsistent) {
  for (int d = 1; d <= 3; ++d)
    for (const LossKind kind : kKinds) {
      const LossWeight weight({kind, std::nullopt}, d);
      const double k = efficient_constant(kind, d);
      for (const double r : {0.0, 0.7, 1.6, 3.0, 5.1, 40.0})
        EXPECT_NEAR(weight(r * r), weight_and_slope(kind, k, r).first, 1e-12);
      if (kind == LossKind::kStudent) {
        const double s = student_scale(k, d);
        const double mean = normal_mean(d, [&](double r) { return weight(r * r / (s * s)) * r * r / (s * s); });
        EXPECT_NEAR(weight.consistency(), mean / d, 1e-6);
      } else {
        EXPECT_NEAR(weight.consistency(), normal_mean(d, [&](double r) { return weight(r * r) * r * r; }) / d, 1e-6);
      }
    }
}

TEST(RobustLoss, IsReadAsItIsWritten) {
  for (const std::string text : {"student:4", "huber:1.5", "cauchy:2.25", "tukey:6"})
    EXPECT_EQ(loss_spec(parse_loss(text), 2), text);
  EXPECT_EQ(loss_spec(parse_loss("tukey"), 2), "tukey:5.12299");
  EXPECT_NE(error_of([] { parse_loss("welsch"); }).find("tukey"), std::string::npos);
  EXPECT_NE(error_of([] { parse_loss("huber:0"); }).find("greater than 0"), std::string::npos);
  EXPECT_NE(error_of([] { parse_loss("huber:x"); }).find("huber:x"), std::string::npos);
}

}  // namespace
}  // namespace pulson::matching
