// What an ensemble's bits do not depend on, and what it refuses.

#include <algorithm>
#include <cmath>

#include "ensemble_examples.hpp"

namespace pulson::ensemble {
namespace {

/// Everything is kept, paths get lost, and the last block is not full.
EnsembleExample full_example(const std::string& integrator) {
  EnsembleExample example{.noise = "trouve-vialard:sigma=0.6+ch-sd:beta=1", .integrator = integrator};
  example.options = options_of({4, 200}, integrator == "variational" ? 5 * 64 + 10 : 64 + 10, 9);
  example.options.momentum_bound = 6;
  example.options.antithetic = true;
  example.options.records = {0, 7, 120, 200};
  example.options.histograms = {7, 200};
  example.options.keep = KeepStates::kAll;
  return example;
}

class EnsembleBits : public testing::TestWithParam<std::string> {};

TEST_P(EnsembleBits, AreTheSameForAnyNumberOfThreadsAndAnyPortions) {
  const EnsembleExample example = full_example(GetParam());
  WithThreads one(1);
  const EnsembleSums whole = example.sums(100);
  EXPECT_GT(whole.paths.momentum_bound, 0);
  EXPECT_GT(whole.paths.clean, 0);
  for (const int threads : {1, 2, 3}) {
    for (const int blocks : {1, 2, 100}) {
      SCOPED_TRACE(std::to_string(threads) + " threads, blocks by " + std::to_string(blocks));
      set_thread_count(threads);
      expect_same_bits(example.sums(blocks), whole);
    }
  }
}

TEST_P(EnsembleBits, AreTheSameAfterAnInterruption) {
  const EnsembleExample example = full_example(GetParam());
  const EnsembleSums whole = example.sums();
  for (const int before : {0, 1, 2, 100}) {
    SCOPED_TRACE(before);
    Ensemble first = example.ensemble();
    first.advance(before);
    EXPECT_EQ(first.sums().samples, std::min<std::int64_t>(64 * before, example.options.samples));
    Ensemble second = example.ensemble();
    second.resume(first.sums());
    while (!second.done()) second.advance(1);
    expect_same_bits(second.sums(), whole);
  }
}

TEST_P(EnsembleBits, AreTheSameWhereOtherProcessesSampled) {
  const EnsembleExample example = full_example(GetParam());
  const EnsembleSums whole = example.sums();
  for (const std::int64_t count : {1, 2, 4}) {
    SCOPED_TRACE(count);
    Ensemble first = example.ensemble();
    while (!first.done()) {
      const Ensemble other = example.ensemble();
      const std::int64_t begin = first.blocks_done();
      first.append(sums_of_bytes(bytes_of(other.sample(begin, std::min(count, first.blocks() - begin)))));
    }
    expect_same_bits(first.sums(), whole);
  }
}

TEST_P(EnsembleBits, ThatEndEarlyAreRefused) {
  const std::string bytes = bytes_of(full_example(GetParam()).ensemble().sample(1, 1));
  for (const std::size_t length : {std::size_t{0}, std::size_t{7}, bytes.size() / 2, bytes.size() - 1})
    EXPECT_THROW(static_cast<void>(sums_of_bytes(std::string_view(bytes).substr(0, length))), InputError) << length;
}

TEST_P(EnsembleBits, AreFinalWhenAllSamplesAreThere) {
  Ensemble ensemble = full_example(GetParam()).ensemble();
  ensemble.advance(100);
  ASSERT_TRUE(ensemble.done());
  const EnsembleSums sums = ensemble.sums();
  ensemble.advance(3);
  expect_same_bits(ensemble.sums(), sums);
}

TEST_P(EnsembleBits, OfFewerSamplesAreABeginning) {
  EnsembleExample example = full_example(GetParam());
  const EnsembleSums more = example.sums();
  for (const std::int64_t samples : {2, 62, 64, 66}) {
    example.options.samples = samples;
    const EnsembleSums fewer = example.sums();
    EXPECT_EQ(fewer.samples, samples);
    EXPECT_EQ(fewer.paths.total(), samples);
    EXPECT_EQ(fewer.moments.front().count, samples);
    EXPECT_EQ(fewer.histograms.back().back().total(), fewer.moments.back().count);
    ASSERT_LT(fewer.states.size(), more.states.size());
    EXPECT_EQ(std::memcmp(fewer.states.data(), more.states.data(), fewer.states.size() * sizeof(double)), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Integrator, EnsembleBits, testing::Values("variational", "midpoint"),
                         [](const auto& parameter) { return parameter.param; });

TEST(EnsembleHistograms, HoldTheSamplesOfTheMoments) {
  const EnsembleSums sums = full_example("variational").sums();
  for (const std::size_t record : {std::size_t{0}, std::size_t{2}}) EXPECT_TRUE(sums.histograms[record].empty());
  for (const std::size_t record : {std::size_t{1}, std::size_t{3}}) {
    ASSERT_EQ(sums.histograms[record].size(), 4U);
    for (std::size_t c = 0; c < 4; ++c) {
      const Histogram& h = sums.histograms[record][c];
      const Moments& moments = sums.moments[record];
      EXPECT_EQ(h.total(), moments.count);
      EXPECT_LT(h.smallest, h.largest);
      double smallest = std::numeric_limits<double>::infinity();
      double largest = -smallest;
      double mean = 0;
      for (std::size_t m = 0; m < static_cast<std::size_t>(sums.samples); ++m) {
        const double x = sums.states[(m * 4 + record) * 4 + c];
        if (std::isnan(x)) continue;
        smallest = std::min(smallest, x);
        largest = std::max(largest, x);
        mean += x / static_cast<double>(moments.count);
      }
      EXPECT_EQ(h.smallest, smallest);
      EXPECT_EQ(h.largest, largest);
      EXPECT_NEAR(moments.mean[static_cast<Eigen::Index>(c)], mean, 1e-12 * (1 + std::abs(mean)));
    }
  }
}

// Ranges are those of the first block, of which hardly a path is clean at the end.
TEST(EnsembleHistograms, HaveQuantilesWhereMostPathsAreLost) {
  EnsembleExample example{.noise = "trouve-vialard:sigma=1.5", .options = options_of({4, 200}, 6400, 3)};
  example.options.momentum_bound = 4.2;
  example.options.histograms = {200};
  example.options.keep = KeepStates::kFinal;
  const EnsembleSums sums = example.sums();
  ASSERT_GT(sums.paths.clean, 100);
  for (std::size_t c = 0; c < 4; ++c) {
    std::vector<double> values;
    for (std::size_t i = c; i < sums.states.size(); i += 4)
      if (!std::isnan(sums.states[i])) values.push_back(sums.states[i]);
    std::sort(values.begin(), values.end());
    const auto sample_quantile = [&](double p) {
      return values[static_cast<std::size_t>(p * static_cast<double>(values.size()))];
    };
    const double spread = sample_quantile(0.95) - sample_quantile(0.05);
    for (const double p : {0.05, 0.25, 0.5, 0.75, 0.95})
      EXPECT_NEAR(sums.histograms[0][c].quantile(p), sample_quantile(p), 0.1 * spread) << c << ", " << p;
  }
}

void expect_refused(const EnsembleExample& example, const std::string& part) {
  try {
    example.ensemble();
    ADD_FAILURE() << "not refused: " << part;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(EnsembleOptions, OutOfTheirRangeAreRefused) {
  const EnsembleExample good{.options = options_of({1, 10}, 4)};
  for (const std::int64_t samples : {0, -3}) {
    EnsembleExample example = good;
    example.options.samples = samples;
    expect_refused(example, "at least one is needed");
  }
  EnsembleExample odd = good;
  odd.options.antithetic = true;
  odd.options.samples = 5;
  expect_refused(odd, "come in pairs");
  for (const double bound : {0.0, -1.0, std::nan("")}) {
    EnsembleExample example = good;
    example.options.momentum_bound = bound;
    expect_refused(example, "momentum bound");
  }
  EnsembleExample integrator = good;
  integrator.integrator = "eular";
  expect_refused(integrator, "unknown integrator 'eular'");
  EnsembleExample noise = good;
  noise.noise = "ch-sd:beta=1,on=3";
  expect_refused(noise, "on=3");
}

TEST(EnsembleOptions, SpreadStepsHoldTheFirstAndTheLast) {
  EXPECT_EQ(spread_steps({1, 10}, 3), (std::vector<int>{0, 5, 10}));
  EXPECT_EQ(spread_steps({1, 10}, 2), (std::vector<int>{0, 10}));
  EXPECT_EQ(spread_steps({1, 3}, 101), (std::vector<int>{0, 1, 2, 3}));
  const std::vector<int> many = spread_steps({1, 10'000'000}, 7);
  EXPECT_EQ(many.size(), 7U);
  EXPECT_EQ(many.back(), 10'000'000);
  EXPECT_TRUE(std::is_sorted(many.begin(), many.end()));
}

/// With histograms of the second record and the third.
EnsembleExample resumable_example() {
  EnsembleExample example{.options = options_of({1, 10}, 200)};
  example.options.records = {0, 5, 10};
  example.options.histograms = {5, 10};
  return example;
}

/// The first block of another ensemble.
void expect_other(const EnsembleExample& example, const std::string& what) {
  Ensemble first = example.ensemble();
  first.advance(1);
  Ensemble second = resumable_example().ensemble();
  EXPECT_THROW(second.resume(first.sums()), InputError) << what;
}

TEST(EnsembleResume, RefusesSumsOfAnother) {
  EnsembleExample other = resumable_example();
  other.options.records = {0, 10};
  expect_other(other, "other records");
  other = resumable_example();
  other.options.antithetic = true;
  expect_other(other, "antithetic");
  other = resumable_example();
  other.options.keep = KeepStates::kFinal;
  expect_other(other, "states");
  other = resumable_example();
  other.options.samples = 30;
  expect_other(other, "a part of a block");
  other = resumable_example();
  other.start = {(Points(1, 3) << 0, 3, 6).finished(), (Points(1, 3) << 4, 1, 0).finished()};
  expect_other(other, "three landmarks");
  other = resumable_example();
  other.options.histograms = {};
  expect_other(other, "other histograms");
}

TEST(EnsembleResume, RefusesSumsThatDoNotAddUp) {
  EnsembleExample good = resumable_example();
  good.options.samples = 100;
  Ensemble ensemble = good.ensemble();
  ensemble.advance(1);
  EnsembleSums sums = ensemble.sums();
  ++sums.paths.tie;
  EXPECT_THROW(good.ensemble().resume(sums), InputError);
  sums = ensemble.sums();
  sums.samples = 128;
  sums.paths.clean = 128;
  EXPECT_THROW(good.ensemble().resume(sums), InputError) << "more than there are to be";
  sums = ensemble.sums();
  sums.histograms.clear();
  EXPECT_THROW(good.ensemble().resume(sums), InputError);
}

// The program takes up to 1e10 samples, and at time 0 all are in one bin.
TEST(EnsembleResume, CountsMoreThanAWordHolds) {
  constexpr std::int64_t kMany = (std::int64_t{1} << 32U) - 64;
  EnsembleExample example{.options = options_of({1, 10}, kMany + 128)};
  example.options.records = {0, 10};
  example.options.histograms = {0};
  Ensemble ensemble = example.ensemble();
  ensemble.advance(1);
  EnsembleSums sums = ensemble.sums();
  sums.samples = sums.paths.clean = kMany;
  MomentNode node = sums.tree.nodes().front();
  sums.tree = {};
  for (int level = 25; level >= 0; --level) {
    node.level = level;
    for (Moments& moments : node.moments) moments.count = std::int64_t{64} << level;
    sums.tree.add(node);
    node.first_block = node.end_block();
  }
  for (Histogram& h : sums.histograms.front())
    for (auto& count : h.counts)
      if (count > 0) count = static_cast<std::remove_reference_t<decltype(count)>>(kMany);
  ensemble.resume(std::move(sums));
  ensemble.advance(2);
  EXPECT_EQ(ensemble.sums().samples, kMany + 128);
  for (const Histogram& h : ensemble.sums().histograms.front()) EXPECT_EQ(h.total(), kMany + 128);
  EXPECT_EQ(ensemble.sums().moments.back().count, kMany + 128);
}

}  // namespace
}  // namespace pulson::ensemble
