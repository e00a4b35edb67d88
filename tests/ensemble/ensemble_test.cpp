// Sample paths: what they are a function of, and what becomes of those that cannot be followed.

#include "pulson/ensemble/ensemble.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "path_sampler.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {
namespace {

const PhaseState kPair{(Points(1, 2) << 0, 10).finished(), (Points(1, 2) << 4, 1).finished()};

std::vector<SamplePath> sample(const std::string& noise, const PhaseState& start, const SamplePathsOptions& options,
                               const std::string& integrator = "variational") {
  return sample_paths({make_kernel("gaussian:alpha=1", {}), make_noise(noise)}, *make_integrator(integrator), start,
                      options);
}

TEST(SamplePaths, ArePathsOfTheirSeedAndNumberAlone) {
  const SamplePathsOptions few{.grid = {2, 100}, .seed = 5, .samples = 3};
  SamplePathsOptions many = few;
  many.samples = 9;
  const auto a = sample("ch-sd:beta=1.5,on=2", kPair, few);
  const auto b = sample("ch-sd:beta=1.5,on=2", kPair, many);
  for (std::size_t m = 0; m < a.size(); ++m) {
    EXPECT_EQ(a[m].path.increments, brownian_increments(5, m, 1, few.grid));
    EXPECT_EQ(a[m].path.final().q, b[m].path.final().q);
    EXPECT_EQ(a[m].status, PathStatus::kClean);
    EXPECT_LE(a[m].momentum_error, 1e-14);
  }
  EXPECT_NE(a[0].path.final().q, a[1].path.final().q);
}

TEST(SamplePaths, HaveTheSameBitsForAnyNumberOfThreads) {
  const SamplePathsOptions options{.grid = {2, 50}, .seed = 5, .samples = 20};
  set_thread_count(1);
  const auto one = sample("ch-sd-screened:beta=1,gamma=4", kPair, options);
  set_thread_count(3);
  const auto three = sample("ch-sd-screened:beta=1,gamma=4", kPair, options);
  set_thread_count(0);
  for (std::size_t m = 0; m < one.size(); ++m) {
    EXPECT_EQ(one[m].path.final().q, three[m].path.final().q);
    EXPECT_EQ(one[m].path.final().p, three[m].path.final().p);
  }
}

// Two landmarks that rush apart from close together: the branch of the root ends.
TEST(SamplePaths, EndWhereAStepHasNoRoot) {
  const PhaseState start{(Points(1, 2) << 0, 0.1).finished(), (Points(1, 2) << -50, 50).finished()};
  const auto samples = sample("none", start, {.grid = {3, 3}, .samples = 1});
  EXPECT_EQ(samples[0].status, PathStatus::kNoRoot);
  EXPECT_EQ(samples[0].path.states.size(), 1U);
  EXPECT_EQ(samples[0].path.final().q, start.q);
  EXPECT_NE(samples[0].reason.find("no unique solution"), std::string::npos) << samples[0].reason;
}

TEST(SamplePaths, KeepWhatComesBeforeTheStepThatFails) {
  int ended = 0;
  for (const SamplePath& one :
       sample("p-sd:beta=2,fields=cos", kPair, {.grid = {20, 200}, .seed = 1, .samples = 20}, "variational-paper")) {
    if (one.status != PathStatus::kNoRoot) continue;
    ++ended;
    EXPECT_EQ(one.path.states.size(), static_cast<std::size_t>(one.path.grid.steps) + 1);
    EXPECT_LT(one.path.grid.steps, 200);
    EXPECT_NEAR(one.path.grid.dt(), 0.1, 1e-15);
  }
  EXPECT_GT(ended, 0);
}

TEST(SamplePaths, TellsMomentaThatPassTheBound) {
  const auto samples =
      sample("ch-sd:beta=1.5,on=2", kPair, {.grid = {2, 100}, .seed = 5, .samples = 1, .momentum_bound = 3.5});
  EXPECT_EQ(samples[0].status, PathStatus::kMomentumBound);
  EXPECT_GE(samples[0].largest_momentum, 4);
  EXPECT_EQ(samples[0].path.states.size(), 101U);
}

TEST(SamplePaths, HasNamesForItsStatus) {
  EXPECT_EQ(path_status_name(PathStatus::kClean), "clean");
  EXPECT_EQ(path_status_name(PathStatus::kNoRoot), "no_root");
  EXPECT_EQ(path_status_name(PathStatus::kMomentumBound), "momentum_bound");
}

// How many paths of a block run, of those asked for.
int paths_sampled(const std::string& noise, std::size_t lanes) {
  const PhaseState start{(Points(2, 3) << 0, 1, 2, 0, 0.5, 0).finished(), Points::Ones(2, 3)};
  const StochasticSystem system{make_kernel("gaussian:alpha=1", {}), make_noise(noise)};
  const auto sampler = make_path_sampler(system, "variational", start, {.grid = {1, 4}, .records = {2, 4}});
  int running = 0;
  const LaneEnds ends = sampler->sample(0, lanes, [&](std::size_t, const LaneStates& states) {
    running += static_cast<int>(std::count(states.running.begin(), states.running.end(), true));
  });
  EXPECT_EQ(std::count(ends.reached_end.begin(), ends.reached_end.end(), true), static_cast<std::ptrdiff_t>(lanes));
  return running / 2;  // records
}

TEST(PathSamplers, SampleNoPathsThatAreNotAskedFor) {
  for (const char* const noise : {"ch-sd:beta=0.1", "ch-sd-screened:beta=0.1,gamma=1"})
    for (const int lanes : {1, 17, 64})
      EXPECT_EQ(paths_sampled(noise, static_cast<std::size_t>(lanes)), lanes) << noise;
}

// The first block of few paths is sampled once, for the ranges of histograms and for the sums.
TEST(Ensembles, OfFewPathsAreOfTheSamePathsWithAndWithoutHistograms) {
  const PhaseState start{(Points(2, 3) << 0, 1, 2, 0, 0.5, 0).finished(), Points::Ones(2, 3)};
  const StochasticSystem system{make_kernel("gaussian:alpha=1", {}), make_noise("ch-sd:beta=0.1")};
  for (const std::int64_t samples : {1, 64, 100}) {
    EnsembleOptions options;
    options.grid = {1, 4};
    options.samples = samples;
    options.records = {0, 2, 4};
    options.keep = KeepStates::kAll;
    Ensemble plain(system, "variational", start, options);
    options.histograms = {2, 4};
    Ensemble binned(system, "variational", start, options);
    plain.advance(2);
    binned.advance(2);
    EXPECT_EQ(plain.sums().states, binned.sums().states);
    EXPECT_EQ(binned.sums().histograms[1].front().total(), samples);
    EXPECT_EQ(plain.sums().moments[2].count, samples);
    EXPECT_TRUE((plain.sums().moments[2].mean == binned.sums().moments[2].mean).all());
  }
}

}  // namespace
}  // namespace pulson::ensemble
