// Statistics of 2²⁰ standard normals in every direction that the counter can run; bounds are 5 standard errors.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "random/normals.hpp"

namespace pulson {
namespace {

constexpr std::uint64_t kSampleSeed = 0xA5A5A5A500000007U;

// The four numbers of each path in the first block of the first channel.
std::vector<double> block_of(std::uint64_t seed, std::uint64_t first_path, std::size_t paths) {
  std::vector<double> out(4 * paths);
  fill_standard_normals(seed, first_path, paths, 0, 0, out.data());
  return out;
}

constexpr std::size_t kSample = 1U << 20U;

struct Direction {
  std::string name;
  std::vector<double> numbers;
};

std::vector<Direction> every_direction() {
  constexpr int kQuarter = kSample / 4;
  std::vector<Direction> directions;
  const Eigen::MatrixXd along_steps = standard_normals(kSampleSeed, 0, 1, kSample);
  directions.push_back({"steps", {along_steps.data(), along_steps.data() + kSample}});
  const Eigen::MatrixXd along_channels = standard_normals(kSampleSeed, 1, kQuarter, 4);
  directions.push_back({"channels", {along_channels.data(), along_channels.data() + kSample}});
  directions.push_back({"paths", block_of(kSampleSeed, 2, kQuarter)});
  const auto one_by_one = [](const auto& four_of) {
    std::vector<double> numbers(kSample);
    for (std::size_t i = 0; i < kQuarter; ++i) {
      const std::vector<double> four = four_of(i);
      for (std::size_t s = 0; s < 4; ++s) numbers[s * kQuarter + i] = four[s];
    }
    return numbers;
  };
  directions.push_back(
      {"high halves of paths", one_by_one([](std::uint64_t i) { return block_of(kSampleSeed, i << 32U, 1); })});
  directions.push_back({"seeds", one_by_one([](std::uint64_t i) { return block_of(i, 0, 1); })});
  directions.push_back({"high halves of seeds", one_by_one([](std::uint64_t i) { return block_of(i << 32U, 0, 1); })});
  return directions;
}

class NormalStatistics : public testing::Test {
 protected:
  static void SetUpTestSuite() { directions = every_direction(); }
  static void TearDownTestSuite() { directions.clear(); }
  inline static std::vector<Direction> directions;
};

double mean_power(const std::vector<double>& numbers, int power) {
  double sum = 0;
  for (const double x : numbers) sum += std::pow(x, power);
  return sum / static_cast<double>(numbers.size());
}

// E x²ᵏ = (2k − 1)!!; the standard error of the mean of xᵖ is √((E x²ᵖ − (E xᵖ)²)/n).
TEST_F(NormalStatistics, MomentsAreThoseOfTheNormalDistribution) {
  const std::array<double, 13> moment = {1, 0, 1, 0, 3, 0, 15, 0, 105, 0, 945, 0, 10395};
  for (const Direction& direction : directions)
    for (std::size_t power = 1; power <= 6; ++power) {
      const double expected = moment.at(power);
      const double error = std::sqrt((moment.at(2 * power) - expected * expected) / kSample);
      EXPECT_NEAR(mean_power(direction.numbers, static_cast<int>(power)), expected, 5 * error)
          << direction.name << ", power " << power;
    }
}

TEST_F(NormalStatistics, HistogramPassesChiSquare) {
  constexpr int kBins = 1024;  // of equal probability; χ² has mean kBins − 1 and variance 2(kBins − 1)
  for (const Direction& direction : directions) {
    std::vector<double> counts(kBins);
    for (const double x : direction.numbers)
      counts.at(static_cast<std::size_t>(kBins * 0.5 * std::erfc(-x / std::numbers::sqrt2))) += 1;
    const double expected = static_cast<double>(kSample) / kBins;
    double chi_square = 0;
    for (const double count : counts) chi_square += (count - expected) * (count - expected) / expected;
    EXPECT_NEAR(chi_square, kBins - 1, 5 * std::sqrt(2.0 * (kBins - 1))) << direction.name;
  }
}

TEST_F(NormalStatistics, TailsHaveTheirWeight) {
  for (const Direction& direction : directions)
    for (const double edge : {3.0, 3.5, 4.0}) {
      const double expected = kSample * std::erfc(edge / std::numbers::sqrt2);
      const auto beyond = std::count_if(direction.numbers.begin(), direction.numbers.end(),
                                        [edge](double x) { return std::abs(x) > edge; });
      EXPECT_NEAR(static_cast<double>(beyond), expected, 5 * std::sqrt(expected)) << direction.name << ", " << edge;
    }
}

// Correlation of f(x_i) and f(x_{i+lag}), f of mean 0 and variance 1: its standard error is 1/√n.
double lag_correlation(const std::vector<double>& numbers, std::size_t lag, double (*f)(double)) {
  double sum = 0;
  for (std::size_t i = 0; i + lag < numbers.size(); ++i) sum += f(numbers[i]) * f(numbers[i + lag]);
  return sum / static_cast<double>(numbers.size() - lag);
}

TEST_F(NormalStatistics, NeighboursAreUncorrelatedAndSoAreTheirSquares) {
  const auto square = [](double x) { return (x * x - 1) / std::numbers::sqrt2; };
  for (const Direction& direction : directions)
    for (const std::size_t lag : {1U, 2U, 3U, 4U, 5U, 8U, 16U, 1U << 10U, 1U << 18U}) {
      const double error = 1 / std::sqrt(static_cast<double>(kSample - lag));
      EXPECT_NEAR(lag_correlation(direction.numbers, lag, [](double x) { return x; }), 0, 5 * error)
          << direction.name << ", lag " << lag;
      EXPECT_NEAR(lag_correlation(direction.numbers, lag, square), 0, 5 * error)
          << "squares, " << direction.name << ", lag " << lag;
    }
}

}  // namespace
}  // namespace pulson
