// The maximum of the evidence over the numbers of a model, and the intervals about it.

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "evidence_maximum.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// −½ (x − m)ᵀA(x − m) with m = (1, −2)
const MatrixXd kInformation{{4, 1.5}, {1.5, 1}};
const VectorXd kMiddle{{1, -2}};
double quadratic(const VectorXd& x) { return -0.5 * (x - kMiddle).dot(kInformation * (x - kMiddle)); }
VectorXd gradient(const VectorXd& x) { return -kInformation * (x - kMiddle); }

// The evidence of that, without errors.
std::optional<Evidence> as_evidence(const VectorXd& x) { return Evidence{quadratic(x), {}}; }
// Its greatest where one number is held.
std::optional<ProfilePlace> profile(Index held, double place) {
  const MatrixXd covariance = kInformation.inverse();
  const VectorXd x = kMiddle + covariance.col(held) * ((place - kMiddle[held]) / covariance(held, held));
  return ProfilePlace{x, {quadratic(x), {}}};
}
const Box kWide{VectorXd{{-99, -99}}, VectorXd{{99, 99}}};

// Of an evidence of one number.
ProfileAt of_one(const EvidenceAt& evidence) {
  return [evidence](Index, double place) {
    const VectorXd x = VectorXd::Constant(1, place);
    return ProfilePlace{x, *evidence(x)};
  };
}

LocalEvidence about(const EvidenceAt& evidence, const VectorXd& x, const MatrixXd& metric, const Box& box) {
  return evidence_about(evidence, x, *evidence(x), metric, box);
}

TEST(EvidenceAbout, OfAQuadraticIsThatWhateverTheMetricsScale) {
  const VectorXd x{{0.3, -1.4}};
  for (const double scale : {0.5, 1.0, 3.0}) {
    const LocalEvidence local = about(as_evidence, x, scale * kInformation, kWide);
    EXPECT_LE((local.slope.gradient - gradient(x)).norm(), 1e-9);
    EXPECT_LE((local.slope.information - kInformation).norm(), 1e-9);
  }
}

TEST(EvidenceAbout, TakesTheMetricWhereOneSideHasNoEvidence) {
  const Box box{VectorXd{{0.3, -99}}, kWide.most};
  const VectorXd x{{0.3, -1.4}};
  const LocalEvidence local = about(as_evidence, x, kInformation, box);
  EXPECT_LE((local.slope.gradient - gradient(x)).norm(), 1e-9);
}

// Of 20 shapes of 12 landmarks with much noise draws tell only the evidence without noise, 95 nats below.
TEST(BestPlace, IsNotOneThatIsFarWorseAsDrawsDoNotTellTheOthers) {
  const auto expect = [](const std::vector<PlaceEvidence>& places, std::size_t index, bool by_draws) {
    const BestPlace best = best_place(places);
    EXPECT_EQ(best.index, index);
    EXPECT_EQ(best.by_draws, by_draws);
  };
  expect({{91.1, 103.1}, {182.2, {}}, {188.0, {}}}, 2, false);
  expect({{188.0, 200.1}, {182.2, 201.0}, {91.1, {}}}, 1, true);
  expect({{188.0, 200.1}, {188.5, {}}}, 0, true);  // draws may take that off
  expect({{188.0, {}}, {191.0, {}}, {190.0, {}}}, 1, false);
  expect({{0, 5.0}, {1, 4.0}, {-9, 7.0}}, 2, true);
}

TEST(FindIntervals, OfAQuadraticAreTheMarginalDeviations) {
  const LocalEvidence local = about(as_evidence, kMiddle, kInformation, kWide);
  const Intervals intervals = find_intervals(profile, local, kWide, {0, 0});
  const MatrixXd covariance = kInformation.inverse();
  for (const Index i : {0, 1}) {
    const double half = 1.64485 * std::sqrt(covariance(i, i));
    EXPECT_NEAR(intervals.low[i], kMiddle[i] - half, 0.05 * half);
    EXPECT_NEAR(intervals.high[i], kMiddle[i] + half, 0.05 * half);
  }
}

TEST(FindIntervals, EndAtTheBoxWhereTheEvidenceHasNotFallen) {
  const Box box{VectorXd{{0.9, -99}}, kWide.most};
  const LocalEvidence local = about(as_evidence, kMiddle, kInformation, box);
  const Intervals intervals = find_intervals(profile, local, box, {0, 0});
  EXPECT_EQ(intervals.low[0], -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isfinite(intervals.high[0]));
}

TEST(FindIntervals, HaveNoEndWhereThereIsNoEvidence) {
  const LocalEvidence local = about(as_evidence, kMiddle, kInformation, kWide);
  const ProfileAt one_sided = [](Index held, double place) -> std::optional<ProfilePlace> {
    if (held == 1 && place > kMiddle[1]) return std::nullopt;
    return profile(held, place);
  };
  const Intervals intervals = find_intervals(one_sided, local, kWide, {0, 0});
  EXPECT_EQ(intervals.high[1], std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isfinite(intervals.low[1]));
  EXPECT_TRUE(std::isfinite(intervals.high[0]));
}

TEST(FindIntervals, AreSoughtNearerWhereThereIsNoEvidenceFarther) {
  const LocalEvidence local = about(as_evidence, kMiddle, kInformation, kWide);
  const double half = 1.64485 * std::sqrt(kInformation.inverse()(1, 1));
  const ProfileAt near_only = [&](Index held, double place) -> std::optional<ProfilePlace> {
    if (held == 1 && place > kMiddle[1] + 0.9 * half) return std::nullopt;
    return profile(held, place);
  };
  EXPECT_NEAR(find_intervals(near_only, local, kWide, {0, 0}).high[1], kMiddle[1] + half, 0.05 * half);
}

// log cosh: flatter tails than the parabola at its maximum.
TEST(FindIntervals, FollowEvidenceThatIsNoParabola) {
  const EvidenceAt evidence = [](const VectorXd& x) -> std::optional<Evidence> {
    return Evidence{-std::log(std::cosh(2 * x[0])), {}};
  };
  const VectorXd zero = VectorXd::Zero(1);
  const Box box{VectorXd{{-99}}, VectorXd{{99}}};
  const LocalEvidence local = about(evidence, zero, MatrixXd::Constant(1, 1, 4), box);
  const double end = 0.5 * std::acosh(std::exp(kDropOfNinety));
  EXPECT_NEAR(find_intervals(of_one(evidence), local, box, {0}).high[0], end, 0.06);
}

// A place that is found for the end of one number and has fallen by no more than an interval allows.
TEST(FindIntervals, HaveWhatIsFoundForTheEndsOfOthers) {
  const LocalEvidence local = about(as_evidence, kMiddle, kInformation, kWide);
  const ProfileAt with_another_maximum = [](Index held, double place) {
    if (held == 1 && place > kMiddle[1]) return ProfilePlace{VectorXd{{5, place}}, {-1, {}}};
    return *profile(held, place);
  };
  const Intervals intervals = find_intervals(with_another_maximum, local, kWide, {0, 0});
  EXPECT_EQ(intervals.high[0], 5);
  EXPECT_LT(intervals.low[0], kMiddle[0]);
}

TEST(FallBetween, IsLessByTheErrorOfTheDraws) {
  EXPECT_DOUBLE_EQ(fall_between({3, {}}, {1, {}}), 2);
  const VectorXd groups{{3.5, 2.5}};  // differ by 1: variance ½ · (¼ + ¼)
  EXPECT_DOUBLE_EQ(fall_between({3, groups}, {1, VectorXd::Constant(2, 1)}), 2 / (1 + 0.25 / 4));
  EXPECT_DOUBLE_EQ(fall_between({3, groups}, {1, groups.array() - 2}), 2);  // an error that both have
  EXPECT_DOUBLE_EQ(fall_between({1, groups}, {3, groups.array() + 1}), -2);
}

// Two groups of draws that put the maximum s apart: the drop is as much wider as the draws leave uncertain.
TEST(FindIntervals, AreWiderByTheErrorsOfTheDraws) {
  const double apart = 0.8;
  const EvidenceAt evidence = [&](const VectorXd& x) -> std::optional<Evidence> {
    VectorXd without(2);
    without << -0.5 * std::pow(x[0] - apart / 2, 2), -0.5 * std::pow(x[0] + apart / 2, 2);
    return Evidence{-0.5 * x[0] * x[0], without};
  };
  const Box box{VectorXd{{-99}}, VectorXd{{99}}};
  const LocalEvidence local = about(evidence, VectorXd::Zero(1), MatrixXd::Identity(1, 1), box);
  const double variance = 2 * std::pow(apart / 2, 2) / 2;  // of the jackknife
  const double end = std::sqrt(2 * kDropOfNinety * (1 + variance));
  EXPECT_NEAR(find_intervals(of_one(evidence), local, box, {0}).high[0], end, 0.06);
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
