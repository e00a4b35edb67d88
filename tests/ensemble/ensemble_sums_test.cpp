// What ensembles add up, against direct computation.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "numbers.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson::ensemble {
namespace {

/// Rows of two numbers: one around 0, and one far from it, where sums of squares would cancel.
Eigen::ArrayXXd random_rows(Eigen::Index count, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  Eigen::ArrayXXd x(count, 2);
  for (Eigen::Index row = 0; row < count; ++row) x.row(row) << normal(engine), 1e6 + 3 * normal(engine);
  return x;
}

Moments moments_of_all(const Eigen::ArrayXXd& x) {
  return moments_of(x, std::vector<bool>(static_cast<std::size_t>(x.rows()), true));
}

/// By two passes, with more digits.
void expect_moments_of(const Eigen::ArrayXXd& x, const Moments& found) {
  ASSERT_EQ(found.count, x.rows());
  const auto count = static_cast<long double>(x.rows());
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    long double mean = 0;
    for (const double value : x.col(c)) mean += value;
    mean /= count;
    long double squares = 0;
    for (const double value : x.col(c)) squares += (value - mean) * (value - mean);
    EXPECT_NEAR(found.mean[c], static_cast<double>(mean), 1e-15 * (10 + 3 * std::abs(static_cast<double>(mean))));
    EXPECT_NEAR(found.squares[c], static_cast<double>(squares), 1e-9 * static_cast<double>(squares));
    if (x.rows() < 2) continue;
    const auto variance = static_cast<double>(squares / (count - 1));
    EXPECT_NEAR(found.variance()[c], variance, 1e-9 * variance);
    const double error = std::sqrt(variance / static_cast<double>(x.rows()));
    EXPECT_NEAR(found.standard_error()[c], error, 1e-9 * error);
  }
}

TEST(Moments, OfJoinedSamplesAreThoseOfAll) {
  for (const auto& [first, second] : std::vector<std::pair<Eigen::Index, Eigen::Index>>{
           {1, 1}, {64, 64}, {1, 1000}, {1000, 1}, {100000, 3}, {3, 100000}, {37, 64}}) {
    SCOPED_TRACE(std::to_string(first) + " and " + std::to_string(second));
    const Eigen::ArrayXXd x = random_rows(first + second, 5);
    Moments sum = moments_of_all(x.topRows(first));
    sum.merge(moments_of_all(x.bottomRows(second)));
    expect_moments_of(x, sum);
  }
}

TEST(Moments, OfManyBlocksAreThoseOfAll) {
  const Eigen::ArrayXXd x = random_rows(64 * 500, 6);
  Moments sum;
  for (Eigen::Index row = 0; row < x.rows(); row += 64) sum.merge(moments_of_all(x.middleRows(row, 64)));
  expect_moments_of(x, sum);
}

TEST(Moments, AreUnchangedByNoSamples) {
  const Eigen::ArrayXXd x = random_rows(9, 7);
  Moments sum = moments_of_all(x);
  sum.merge({});
  sum.merge(moments_of(x, std::vector<bool>(9, false)));
  expect_moments_of(x, sum);
  Moments none;
  none.merge({});
  EXPECT_EQ(none.count, 0);
  none.merge(sum);
  expect_moments_of(x, none);
}

TEST(Moments, OfOneSampleHaveNoVariance) {
  const Moments one = moments_of_all(random_rows(1, 8));
  EXPECT_EQ(one.count, 1);
  EXPECT_TRUE((one.squares == 0).all());
  EXPECT_TRUE(one.variance().isNaN().all());
  EXPECT_TRUE(one.standard_error().isNaN().all());
}

TEST(Moments, AreOverTheRowsInUseAlone) {
  const Eigen::ArrayXXd x = random_rows(64, 9);
  std::vector<bool> used(64);
  Eigen::ArrayXXd chosen(0, 2);
  Eigen::ArrayXXd damaged = x;
  for (std::size_t row = 0; row < 64; ++row) {
    used[row] = row % 3 == 1 || row == 63;
    if (used[row]) {
      chosen.conservativeResize(chosen.rows() + 1, 2);
      chosen.bottomRows(1) = x.row(static_cast<Eigen::Index>(row));
    } else {
      damaged.row(static_cast<Eigen::Index>(row)).setConstant(kNaN);
    }
  }
  expect_moments_of(chosen, moments_of(damaged, used));
}

Histogram histogram_of(const std::vector<double>& values, double low, double high, std::size_t bins) {
  Histogram histogram;
  histogram.low = low;
  histogram.high = high;
  histogram.counts.assign(bins, 0);
  for (const double x : values) {
    ++histogram.counts[histogram.bin_of(x)];
    histogram.smallest = std::min(histogram.smallest, x);
    histogram.largest = std::max(histogram.largest, x);
  }
  return histogram;
}

TEST(Histogram, HasEqualBinsAndPutsTheRestIntoTheOuterOnes) {
  const Histogram h = histogram_of({}, -1, 3, 8);  // bins of one half, exact in binary
  EXPECT_EQ(h.width(), 0.5);
  EXPECT_EQ(h.total(), 0);
  for (std::size_t bin = 0; bin < 8; ++bin) {
    const double edge = -1 + 0.5 * static_cast<double>(bin);
    EXPECT_EQ(h.bin_of(edge), bin);
    EXPECT_EQ(h.bin_of(edge + 0.25), bin);
    EXPECT_EQ(h.bin_of(edge + 0.5 - 1e-12), bin);
  }
  for (const double x : {-1.0000001, -2.0, -1e300, -kInfinity}) EXPECT_EQ(h.bin_of(x), 0U) << x;
  for (const double x : {3.0, 3.5, 1e12, 1e300, kInfinity}) EXPECT_EQ(h.bin_of(x), 7U) << x;
  EXPECT_LT(h.bin_of(kNaN), 8U);
}

const std::vector<double> kProbabilities = {0, 0.001, 0.05, 0.25, 0.5, 0.75, 0.95, 0.999, 1};

TEST(Histogram, QuantilesAreWithinABinOfThoseOfTheSamples) {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  for (const std::size_t count : {1U, 2U, 7U, 64U, 20001U}) {
    std::vector<double> values(count);
    for (double& x : values) x = 5 + 2 * normal(engine);
    const Histogram h = histogram_of(values, -5, 15, 100);
    EXPECT_EQ(h.total(), static_cast<std::int64_t>(count));
    std::sort(values.begin(), values.end());
    double before = -std::numeric_limits<double>::infinity();
    for (const double probability : kProbabilities) {
      const double x = h.quantile(probability);
      const auto below = static_cast<std::size_t>(std::ceil(probability * static_cast<double>(count)));
      EXPECT_NEAR(x, values[std::max<std::size_t>(below, 1) - 1], h.width()) << count << ", " << probability;
      EXPECT_GE(x, before);
      EXPECT_GE(x, values.front());
      EXPECT_LE(x, values.back());
      before = x;
    }
  }
}

TEST(Histogram, QuantilesWithinAreNotMovedBySamplesOutside) {
  std::vector<double> values = {-1e6, 1e7};
  for (int i = 0; i < 98; ++i) values.push_back((i + 0.5) / 98);
  const Histogram h = histogram_of(values, 0, 1, 50);
  std::sort(values.begin(), values.end());
  for (const double probability : {0.25, 0.5, 0.75})
    EXPECT_NEAR(h.quantile(probability), values[static_cast<std::size_t>(100 * probability) - 1], h.width());
}

TEST(Histogram, QuantilesOfAConstantAreExact) {
  for (const double x : {0.1, -3e5, 0.0}) {
    const Histogram h = histogram_of(std::vector<double>(17, x), x - 0.3, x + 0.9, 64);
    for (const double probability : kProbabilities) EXPECT_EQ(h.quantile(probability), x);
  }
  EXPECT_TRUE(std::isnan(histogram_of({}, 0, 1, 8).quantile(0.5)));
}

/// Sums of paths that are each lost, clean, or clean and crossed.
EnsembleSums crossing_sums(const std::vector<int>& paths, bool antithetic) {
  EnsembleSums sums;
  sums.samples = static_cast<std::int64_t>(paths.size());
  for (const int crossed : paths) {
    ++(crossed < 0 ? sums.paths.no_root : sums.paths.clean);
    sums.crossing.at_end += crossed > 0 ? 1 : 0;
  }
  for (std::size_t i = 0; antithetic && i < paths.size(); i += 2)
    if (paths[i] >= 0 && paths[i + 1] >= 0) ++sums.crossing.pairs.at(static_cast<std::size_t>(paths[i] + paths[i + 1]));
  return sums;
}

std::vector<int> random_paths(double lost, double correlation) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> uniform;
  std::vector<int> paths;
  for (int pair = 0; pair < 4000; ++pair) {
    const double u = uniform(engine);
    paths.push_back(u < 0.3 ? 1 : 0);
    paths.push_back((uniform(engine) < correlation ? 1 - u : uniform(engine)) < 0.3 ? 1 : 0);
  }
  for (int& path : paths)
    if (uniform(engine) < lost) path = -1;
  return paths;
}

TEST(CrossingProbability, IsThatOfTheCleanPaths) {
  for (const double lost : {0.0, 0.2}) {
    const std::vector<int> paths = random_paths(lost, 0);
    const auto clean = static_cast<double>(paths.size() - std::count(paths.begin(), paths.end(), -1));
    const double p = static_cast<double>(std::count(paths.begin(), paths.end(), 1)) / clean;
    const Estimate found = crossing_sums(paths, false).crossing_probability();
    EXPECT_NEAR(found.value, p, 1e-15);
    EXPECT_NEAR(found.standard_error, std::sqrt(p * (1 - p) / clean), 1e-15);
  }
}

TEST(CrossingProbability, OfAntitheticPairsHasTheErrorOfTheirMeans) {
  for (const double lost : {0.0, 0.2}) {
    const std::vector<int> paths = random_paths(lost, 0.9);
    const Estimate found = crossing_sums(paths, true).crossing_probability();
    EXPECT_EQ(found.value, crossing_sums(paths, false).crossing_probability().value);
    std::vector<double> means;
    for (std::size_t i = 0; i < paths.size(); i += 2)
      if (paths[i] >= 0 && paths[i + 1] >= 0) means.push_back((paths[i] + paths[i + 1]) / 2.0);
    double squares = 0;
    for (const double mean : means) squares += (mean - found.value) * (mean - found.value);
    const auto count = static_cast<double>(means.size());
    EXPECT_NEAR(found.standard_error, std::sqrt(squares / count / count), 1e-12);
    EXPECT_LT(found.standard_error, 0.9 * crossing_sums(paths, false).crossing_probability().standard_error);
  }
}

TEST(CrossingProbability, OfPairsOfWhichOneCrossesHasNoError) {
  const Estimate found = crossing_sums({1, 0, 0, 1, 1, 0}, true).crossing_probability();
  EXPECT_EQ(found.value, 0.5);
  EXPECT_EQ(found.standard_error, 0);
}

TEST(Histogram, JoinsBinsToBarsOfADensity) {
  Histogram histogram;
  histogram.low = 0;
  histogram.high = 100;
  histogram.counts.assign(100, 0);
  for (int i = 0; i < 1000; ++i) {
    const double x = 20 + 60 * (i + 0.5) / 1000;
    ++histogram.counts[histogram.bin_of(x)];
    histogram.smallest = std::min(histogram.smallest, x);
    histogram.largest = std::max(histogram.largest, x);
  }
  const DensityBars bars = histogram.bars(0, 20);
  ASSERT_EQ(bars.values.size(), 20U);
  ASSERT_EQ(bars.edges.size(), 21U);
  EXPECT_DOUBLE_EQ(bars.edges.front(), 20);
  EXPECT_DOUBLE_EQ(bars.edges.back(), 80);
  for (const double value : bars.values) EXPECT_NEAR(value, 1 / 60.0, 0.001);
  EXPECT_LE(histogram.bars(0.1, 7).values.size(), 7U);
}

}  // namespace
}  // namespace pulson::ensemble
