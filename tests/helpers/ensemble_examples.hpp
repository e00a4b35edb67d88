#pragma once

#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pulson/core/parallel.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {

/// Two landmarks on a line.
inline PhaseState pair_at(double q1, double q2, double p1, double p2) {
  return {(Points(1, 2) << q1, q2).finished(), (Points(1, 2) << p1, p2).finished()};
}

inline ensemble::EnsembleOptions options_of(const TimeGrid& grid, std::int64_t samples, std::uint64_t seed = 1) {
  ensemble::EnsembleOptions options;
  options.grid = grid;
  options.seed = seed;
  options.samples = samples;
  return options;
}

/// What an ensemble is made of.
struct EnsembleExample {
  std::string kernel = "gaussian:alpha=1";
  std::string noise = "ch-sd:beta=1.5,on=2";
  std::string integrator = "variational";
  PhaseState start = pair_at(0, 3, 4, 1);
  ensemble::EnsembleOptions options{};

  StochasticSystem system() const { return {make_kernel(kernel, {}), make_noise(noise)}; }
  ensemble::Ensemble ensemble() const { return {system(), integrator, start, options}; }
  /// All samples.
  ensemble::EnsembleSums sums(int blocks_at_once = 8) const {
    ensemble::Ensemble all = ensemble();
    while (!all.done()) all.advance(blocks_at_once);
    return all.sums();
  }
};

/// Sets the number of threads for the time of its life.
class WithThreads {
 public:
  explicit WithThreads(int count) { set_thread_count(count); }
  ~WithThreads() { set_thread_count(0); }
  WithThreads(const WithThreads&) = delete;
  WithThreads& operator=(const WithThreads&) = delete;
};

/// NaN is like NaN of the same bits.
template <class Numbers>
bool same_bits(const Numbers& a, const Numbers& b) {
  if (a.size() != b.size()) return false;
  return a.size() == 0 || std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(a[0])) == 0;
}

inline bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

inline bool same_bits(const std::vector<ensemble::Moments>& a, const std::vector<ensemble::Moments>& b) {
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i)
    same = a[i].count == b[i].count && same_bits(a[i].mean, b[i].mean) && same_bits(a[i].squares, b[i].squares);
  return same;
}

inline bool same_bits(const ensemble::Histogram& a, const ensemble::Histogram& b) {
  return same_bits(a.low, b.low) && same_bits(a.high, b.high) && a.counts == b.counts &&
         same_bits(a.smallest, b.smallest) && same_bits(a.largest, b.largest);
}

/// One failure for each part that differs.
inline void expect_same_bits(const ensemble::EnsembleSums& a, const ensemble::EnsembleSums& b) {
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.paths.clean, b.paths.clean);
  EXPECT_EQ(a.paths.no_root, b.paths.no_root);
  EXPECT_EQ(a.paths.momentum_bound, b.paths.momentum_bound);
  EXPECT_EQ(a.paths.tie, b.paths.tie);
  EXPECT_EQ(a.crossing.at_end, b.crossing.at_end);
  EXPECT_EQ(a.crossing.ever, b.crossing.ever);
  EXPECT_EQ(a.crossing.pairs, b.crossing.pairs);
  EXPECT_TRUE(same_bits(a.momentum_error, b.momentum_error));
  EXPECT_TRUE(same_bits(a.largest_momentum, b.largest_momentum));
  EXPECT_TRUE(same_bits(a.moments, b.moments));
  EXPECT_TRUE(same_bits(a.pair_moments, b.pair_moments));
  EXPECT_TRUE(same_bits(a.states, b.states));
  ASSERT_EQ(a.histograms.size(), b.histograms.size());
  for (std::size_t record = 0; record < a.histograms.size(); ++record) {
    ASSERT_EQ(a.histograms[record].size(), b.histograms[record].size());
    for (std::size_t c = 0; c < a.histograms[record].size(); ++c)
      EXPECT_TRUE(same_bits(a.histograms[record][c], b.histograms[record][c])) << record << ", " << c;
  }
}

}  // namespace pulson
