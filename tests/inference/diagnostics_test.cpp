#include "pulson/inference/diagnostics.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "inference/normal_quantile.hpp"
#include "random/normals.hpp"

namespace pulson::inference {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// x_t = ρx_{t−1} + √(1−ρ²)ξ_t from its stationary law, draws×chains.
MatrixXd autoregressive(double rho, Index draws, int chains, std::uint64_t seed) {
  MatrixXd x(draws, chains);
  for (int c = 0; c < chains; ++c) {
    const MatrixXd xi = standard_normals(seed, static_cast<std::uint64_t>(c), 1, static_cast<int>(draws));
    x(0, c) = xi(0, 0);
    for (Index t = 1; t < draws; ++t) x(t, c) = rho * x(t - 1, c) + std::sqrt(1 - rho * rho) * xi(0, t);
  }
  return x;
}

TEST(NormalQuantile, InvertsTheDistributionFunction) {
  for (const double p : {1e-12, 1e-5, 0.02, 0.3, 0.5, 0.9, 1 - 1e-6})
    EXPECT_NEAR(normal_probability(normal_quantile(p)), p, 1e-14);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-13);
}

// τ = (1 + ρ)/(1 − ρ) for an AR(1) series; the estimate of ESS from n draws varies by about √(2(2M + 1)/n) with the
// number M ~ 3/(1 − ρ) of lags summed (Sokal 1997, (3.16)).
TEST(EffectiveSampleSize, OfAutoregressiveSeriesIsTheClosedForm) {
  for (const double rho : {-0.3, 0.0, 0.5, 0.9}) {
    const Index draws = 20000;
    const int chains = 4;
    const MatrixXd x = autoregressive(rho, draws, chains, 7);
    const double exact = static_cast<double>(draws * chains) * (1 - rho) / (1 + rho);
    const double relative = std::sqrt(2 * (2 * 3 / (1 - std::max(rho, 0.0)) + 1) / static_cast<double>(draws * chains));
    EXPECT_NEAR(effective_sample_size(x) / exact, 1, 4 * relative) << rho;
    EXPECT_NEAR(bulk_ess(x) / exact, 1, 4 * relative) << rho;
  }
}

TEST(EffectiveSampleSize, StandardErrorIsThatOfRepeatedRuns) {
  const double rho = 0.8;
  double squares = 0, claimed = 0;
  const int runs = 200;
  for (int run = 0; run < runs; ++run) {
    const DrawSummary summary = summarise(autoregressive(rho, 1000, 2, 100 + static_cast<std::uint64_t>(run)));
    squares += summary.mean * summary.mean / runs;
    claimed += summary.mcse * summary.mcse / runs;
  }
  EXPECT_NEAR(squares / claimed, 1, 4 * std::sqrt(2.0 / runs));
}

TEST(Rhat, IsNearOneForOneLawAndLargeForSeveral) {
  MatrixXd x = autoregressive(0.5, 2000, 4, 3);
  EXPECT_LT(rank_rhat(x), 1.01);
  MatrixXd shifted = x;
  shifted.col(0).array() += 1;
  EXPECT_GT(rank_rhat(shifted), 1.05);
  MatrixXd scaled = x;  // the same mean: found by folding
  scaled.col(0) *= 3;
  EXPECT_GT(rank_rhat(scaled), 1.05);
}

// Computed by hand: chains (1,2,3,4) and (5,6,7,8) split into (1,2),(3,4),(5,6),(7,8) have the ranks as values.
TEST(Rhat, OfEightNumbersIsThatOfTheFormula) {
  MatrixXd x(4, 2);
  x << 1, 5, 2, 6, 3, 7, 4, 8;
  Eigen::VectorXd z(8);
  for (int i = 0; i < 8; ++i) z[i] = normal_quantile((i + 1 - 0.375) / 8.25);
  double within = 0;
  Eigen::VectorXd means(4);
  for (int c = 0; c < 4; ++c) {
    const double a = z[2 * c], b = z[2 * c + 1];
    means[c] = 0.5 * (a + b);
    within += 0.5 * (a - b) * (a - b) / 4;
  }
  const double between = (means.array() - means.mean()).square().sum() / 3;
  EXPECT_NEAR(rank_rhat(x), std::sqrt((within / 2 + between) / within), 1e-12);
}

TEST(Diagnostics, HaveNoValueWithoutVariation) {
  EXPECT_TRUE(std::isnan(rank_rhat(MatrixXd::Ones(100, 4))));
  EXPECT_TRUE(std::isnan(bulk_ess(MatrixXd::Ones(100, 4))));
  EXPECT_TRUE(std::isnan(rank_rhat(MatrixXd::Random(3, 4))));
  EXPECT_EQ(quantile(Eigen::Vector4d(4, 1, 3, 2), 0.5), 2.5);
  EXPECT_EQ(quantile(Eigen::Vector4d(4, 1, 3, 2), 1), 4);
}

// What the worst of several diagnostics is must not pass over one that is undefined.
TEST(UndefinedDiagnostics, AreNaN) {
  const MatrixXd still = MatrixXd::Constant(100, 2, 3);
  for (const auto& diagnostic : {rank_rhat, effective_sample_size, bulk_ess, tail_ess}) {
    EXPECT_TRUE(std::isnan(diagnostic(still)));
    EXPECT_TRUE(std::isnan(diagnostic(autoregressive(0, 3, 4, 1))));
    MatrixXd broken = autoregressive(0, 100, 2, 1);
    broken(7, 1) = std::nan("");
    EXPECT_TRUE(std::isnan(diagnostic(broken)));
  }
}

// Half chains of five draws have no pair of lags: their draws would count as independent, however they depend.
TEST(UndefinedDiagnostics, AreEffectiveSampleSizesOfShortChains) {
  EXPECT_TRUE(std::isnan(bulk_ess(autoregressive(0.9, 11, 4, 2))));
  EXPECT_TRUE(std::isfinite(bulk_ess(autoregressive(0.9, 12, 4, 2))));
  EXPECT_TRUE(std::isfinite(rank_rhat(autoregressive(0.9, 11, 4, 2))));
}

// More than 5 % of the draws are the greatest: none is above the 95 % quantile, and the tail has no sample size. That
// of the other tail is no answer.
TEST(UndefinedDiagnostics, AreTailsThatChainsStickIn) {
  MatrixXd x = autoregressive(0.5, 200, 1, 5);
  x.topRows(20).setConstant(10);
  EXPECT_TRUE(std::isfinite(bulk_ess(x)));
  EXPECT_TRUE(std::isnan(tail_ess(x)));
}

// Two values at the same distance from the median: the folded draws are constant.
TEST(UndefinedDiagnostics, AreRhatsOfConstantDistances) {
  MatrixXd x(100, 2);
  for (Index i = 0; i < x.size(); ++i) x.reshaped()[i] = i % 2 == 0 ? 1 : -1;
  EXPECT_TRUE(std::isnan(rank_rhat(x)));
}

}  // namespace
}  // namespace pulson::inference
