#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "inference/normal_quantile.hpp"
#include "inference/rank_statistics.hpp"
#include "pulson/inference/posterior.hpp"
#include "random/normals.hpp"

namespace pulson::inference {
namespace {

// Uniform ranks 0 … L.
std::vector<int> uniform_ranks(int count, int largest, std::uint64_t path) {
  const Eigen::MatrixXd normals = standard_normals(11, path, 1, count);
  std::vector<int> ranks;
  for (int i = 0; i < count; ++i)
    ranks.push_back(std::min(largest, static_cast<int>(normal_probability(normals(0, i)) * (largest + 1))));
  return ranks;
}

TEST(RankBand, ProbabilityIsThatOfSimulations) {
  const int simulations = 100, largest = 19;
  const RankBand band = rank_band(simulations, largest);
  const double exact = band_probability(band.lower, band.upper, simulations);
  EXPECT_GE(exact, 0.95);
  EXPECT_LT(exact, 0.965);  // counts are whole numbers
  int inside = 0;
  const int runs = 20000;
  for (int run = 0; run < runs; ++run) {
    const std::vector<int> counts =
        rank_counts(uniform_ranks(simulations, largest, static_cast<std::uint64_t>(run)), largest);
    bool all = true;
    for (std::size_t i = 0; i < counts.size(); ++i)
      all = all && counts[i] >= band.lower[i] && counts[i] <= band.upper[i];
    inside += all ? 1 : 0;
  }
  EXPECT_NEAR(inside / static_cast<double>(runs), exact, 4 * std::sqrt(exact * (1 - exact) / runs));
}

TEST(RankBand, PValuesOfUniformRanksAreUniform) {
  const int runs = 2000;
  int low = 0;
  for (int run = 0; run < runs; ++run)
    low += rank_p_value(rank_counts(uniform_ranks(60, 15, 50000 + static_cast<std::uint64_t>(run)), 15)) <= 0.2 ? 1 : 0;
  EXPECT_LE(low / static_cast<double>(runs), 0.2 + 4 * std::sqrt(0.2 * 0.8 / runs));
  EXPECT_GE(low / static_cast<double>(runs), 0.1);
}

TEST(RankBand, OfOneRankIsTheBinomialInterval) {
  // L = 1: the count of rank 0 is Bin(n, ½), n = 10: 2 P(C ≤ 1) = 0.0215, 2 P(C ≤ 2) = 0.109.
  const RankBand band = rank_band(10, 1);
  EXPECT_EQ(band.lower[0], 2);
  EXPECT_EQ(band.upper[0], 8);
  EXPECT_NEAR(band_probability(band.lower, band.upper, 10), 1 - 22.0 / 1024, 1e-12);
}

}  // namespace
}  // namespace pulson::inference
