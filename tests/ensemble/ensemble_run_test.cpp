// Ensembles against the integrators' single paths, and what their bits may depend on.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ensemble_examples.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {
namespace {

std::vector<SamplePath> paths_of(const EnsembleExample& example) {
  const EnsembleOptions& options = example.options;
  const StochasticSystem system = example.system();
  const auto integrator = make_integrator(example.integrator);
  const int channels =
      system.noise->channels(static_cast<int>(example.start.q.rows()), static_cast<int>(example.start.q.cols()));
  std::vector<SamplePath> paths;
  for (int m = 0; m < options.samples; ++m) {
    const auto number = static_cast<std::uint64_t>(options.antithetic ? m / 2 : m);
    const double sign = options.antithetic && m % 2 == 1 ? -1 : 1;
    paths.push_back(sample_path(system, *integrator, example.start, options.grid,
                                sign * brownian_increments(options.seed, number, channels, options.grid),
                                options.momentum_bound));
  }
  return paths;
}

bool is_clean_until(const SamplePath& path, int step, double bound) {
  if (step >= static_cast<int>(path.path.states.size())) return false;
  return std::all_of(path.path.states.begin(), path.path.states.begin() + step + 1,
                     [&](const PhaseState& state) { return state.p.colwise().norm().maxCoeff() <= bound; });
}

/// On a line, the least of the gaps of neighbours in their order at the start.
double least_gap(const Points& q, const Points& start) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(q.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return start(a) < start(b); });
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; q.rows() == 1 && i < order.size(); ++i)
    least = std::min(least, q(order[i]) - q(order[i - 1]));
  return least;
}

void expect_moments(const std::vector<Eigen::ArrayXd>& rows, const Moments& found) {
  ASSERT_EQ(found.count, static_cast<std::int64_t>(rows.size()));
  if (rows.empty()) return;
  Eigen::ArrayXd mean = Eigen::ArrayXd::Zero(rows.front().size());
  for (const Eigen::ArrayXd& row : rows) mean += row / static_cast<double>(rows.size());
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(mean.size());
  for (const Eigen::ArrayXd& row : rows) squares += (row - mean).square();
  EXPECT_LT((found.mean - mean).abs().maxCoeff(), 1e-9);
  EXPECT_LT((found.squares - squares).abs().maxCoeff(), 1e-9 * (1 + squares.maxCoeff()));
}

void expect_counts(const EnsembleExample& example, const std::vector<SamplePath>& paths, const EnsembleSums& sums) {
  PathCounts counts;
  CrossingCounts crossing;
  for (const SamplePath& path : paths) {
    if (path.status == PathStatus::kMomentumBound) ++counts.momentum_bound;
    if (path.status == PathStatus::kNoRoot) ++counts.no_root;
    if (path.status != PathStatus::kClean) continue;
    ++counts.clean;
    crossing.at_end += least_gap(path.path.final().q, example.start.q) < 0 ? 1 : 0;
    crossing.ever += std::any_of(path.path.states.begin(), path.path.states.end(),
                                 [&](const PhaseState& state) { return least_gap(state.q, example.start.q) < 0; });
  }
  EXPECT_EQ(sums.samples, example.options.samples);
  EXPECT_EQ(sums.paths.clean, counts.clean);
  EXPECT_EQ(sums.paths.no_root, counts.no_root);
  EXPECT_EQ(sums.paths.momentum_bound, counts.momentum_bound);
  EXPECT_EQ(sums.paths.tie, 0);
  EXPECT_EQ(sums.crossing.at_end, crossing.at_end);
  EXPECT_EQ(sums.crossing.ever, crossing.ever);
}

void expect_statistics(const EnsembleExample& example, const std::vector<SamplePath>& paths, const EnsembleSums& sums) {
  const EnsembleOptions& options = example.options;
  ASSERT_EQ(sums.moments.size(), options.records.size());
  const Eigen::VectorXd total = example.start.p.rowwise().sum();
  double momentum_error = 0;
  for (std::size_t record = 0; record < options.records.size(); ++record) {
    SCOPED_TRACE("step " + std::to_string(options.records[record]));
    std::vector<Eigen::ArrayXd> rows;
    std::vector<Eigen::ArrayXd> means;
    bool before = false;  // whether the last path was clean
    for (std::size_t m = 0; m < paths.size(); ++m) {
      const bool clean = is_clean_until(paths[m], options.records[record], options.momentum_bound);
      if (clean) {
        const PhaseState& state = paths[m].path.states[static_cast<std::size_t>(options.records[record])];
        rows.emplace_back(2 * state.q.size());
        rows.back() << state.q.reshaped().array(), state.p.reshaped().array();
        momentum_error = std::max(momentum_error, (state.p.rowwise().sum() - total).norm());
        if (m % 2 == 1 && before) means.emplace_back((rows.back() + rows[rows.size() - 2]) / 2);
      }
      before = clean;
    }
    expect_moments(rows, sums.moments[record]);
    if (options.antithetic) expect_moments(means, sums.pair_moments[record]);
  }
  EXPECT_NEAR(sums.momentum_error, momentum_error / example.start.p.colwise().norm().sum(), 1e-9);
}

void expect_sums_of_paths(const EnsembleExample& example) {
  const std::vector<SamplePath> paths = paths_of(example);
  const EnsembleSums sums = example.sums();
  expect_counts(example, paths, sums);
  expect_statistics(example, paths, sums);
  if (sums.paths.momentum_bound > 0) {
    EXPECT_GT(sums.largest_momentum, example.options.momentum_bound);
    return;
  }
  double largest = 0;
  for (const SamplePath& path : paths) largest = std::max(largest, path.largest_momentum);
  EXPECT_NEAR(sums.largest_momentum, largest, 1e-9 * largest);
}

const EnsembleOptions kShort = [] {
  EnsembleOptions options = options_of({4, 200}, 100, 3);
  options.records = {0, 50, 133, 200};
  return options;
}();

TEST(EnsembleRun, OfPairLanesIsThatOfSinglePaths) {
  const EnsembleExample example{.options = kShort};
  ASSERT_EQ(example.ensemble().method(), "pair lanes");
  const EnsembleSums sums = example.sums();
  ASSERT_GT(sums.crossing.at_end, 10);
  ASSERT_GT(sums.crossing.ever, sums.crossing.at_end);
  expect_sums_of_paths(example);
}

TEST(EnsembleRun, OfOtherSystemsIsThatOfSinglePaths) {
  expect_sums_of_paths({.kernel = "gaussian:alpha=1+peakon:alpha=0.5,weight=0.3", .options = kShort});
  const EnsembleExample by_midpoint{.integrator = "midpoint", .options = kShort};
  EXPECT_NE(by_midpoint.ensemble().method(), "pair lanes");
  expect_sums_of_paths(by_midpoint);
  const PhaseState three{(Points(1, 3) << 5, 0, 2).finished(), (Points(1, 3) << -1, 4, 1).finished()};
  const EnsembleExample on_a_line{.noise = "ch-sd:beta=1", .start = three, .options = kShort};
  EXPECT_GT(on_a_line.sums().crossing.at_end, 0);
  expect_sums_of_paths(on_a_line);
  const PhaseState plane{(Points(2, 3) << 0, 2, 1, 0, 0, 1).finished(), (Points(2, 3) << 1, 0, -1, 0, 2, 1).finished()};
  const EnsembleExample in_the_plane{.noise = "ch-sd:beta=1", .start = plane, .options = kShort};
  EXPECT_EQ(in_the_plane.sums().crossing.ever, 0);
  expect_sums_of_paths(in_the_plane);
}

// Statistics of a time are over the paths that were clean up to then.
TEST(EnsembleRun, LeavesOutPathsFromWhereTheyAreLost) {
  for (const std::string integrator : {"variational", "midpoint"}) {
    SCOPED_TRACE(integrator);
    EnsembleExample example{.noise = "trouve-vialard:sigma=1.5", .integrator = integrator, .options = kShort};
    example.options.momentum_bound = 6;
    const EnsembleSums sums = example.sums();
    EXPECT_GT(sums.moments[1].count, sums.moments[2].count);
    EXPECT_GT(sums.moments[2].count, sums.moments[3].count);
    EXPECT_EQ(sums.moments[3].count, sums.paths.clean);
    EXPECT_GT(sums.paths.clean, 0);
    expect_sums_of_paths(example);
  }
}

TEST(EnsembleRun, OfAntitheticPathsIsThatOfSinglePaths) {
  for (const std::string integrator : {"variational", "midpoint"}) {
    SCOPED_TRACE(integrator);
    EnsembleExample example{.integrator = integrator, .options = kShort};
    example.options.antithetic = true;
    expect_sums_of_paths(example);
    example.noise = "trouve-vialard:sigma=1.5";
    example.options.momentum_bound = 6;
    expect_sums_of_paths(example);
  }
}

// A pair whose landmarks feel their noise alone.
TEST(EnsembleRun, TurnsTheNoiseOfEverySecondAntitheticPath) {
  for (const std::string kernel : {"gaussian:alpha=1,weight=1e-12", "gaussian:alpha=1,weight=1e-12+peakon:alpha=1"}) {
    SCOPED_TRACE(kernel);
    EnsembleExample example{
        .kernel = kernel, .noise = "ch-sd:beta=1.5+trouve-vialard:sigma=0.5", .start = pair_at(0, 1000, 0, 0)};
    example.options = options_of({1, 50}, 198);
    example.options.antithetic = true;
    example.options.keep = KeepStates::kFinal;
    if (kernel.find('+') != std::string::npos) example.noise = "ch-sd:beta=1.5";  // no momenta
    const EnsembleSums sums = example.sums();
    const Eigen::Map<const Eigen::ArrayXXd> ends(sums.states.data(), 4, 198);
    const Eigen::Array4d start(0, 1000, 0, 0);
    for (Eigen::Index j = 0; j < 198; j += 2) {
      EXPECT_LT((ends.col(j) + ends.col(j + 1) - 2 * start).abs().maxCoeff(), 1e-9) << j;
      EXPECT_GT((ends.col(j) - start).abs().maxCoeff(), 1e-3) << j;
    }
    EXPECT_LT((sums.moments.back().mean - start).abs().maxCoeff(), 1e-9);
    EXPECT_LT(sums.mean_error(0).maxCoeff(), 1e-9);
    example.options.antithetic = false;
    const EnsembleSums plain = example.sums();
    const Eigen::Map<const Eigen::ArrayXXd> plain_ends(plain.states.data(), 4, 198);
    for (Eigen::Index j = 0; j < 99; ++j) EXPECT_TRUE((ends.col(2 * j) == plain_ends.col(j)).all()) << j;
    EXPECT_GT((plain.moments.back().mean - start).abs().maxCoeff(), 1e-3);
  }
}

TEST(EnsembleRun, KeepsStatesUpToWhereAPathIsLost) {
  for (const std::string integrator : {"variational", "midpoint"}) {
    EnsembleExample example{.noise = "trouve-vialard:sigma=1.5", .integrator = integrator, .options = kShort};
    example.options.momentum_bound = 6;
    example.options.keep = KeepStates::kAll;
    EXPECT_EQ(example.options.kept_numbers(example.start), 16);
    const std::vector<double> all = example.sums().states;
    const std::vector<SamplePath> paths = paths_of(example);
    ASSERT_EQ(all.size(), 1600U);
    for (std::size_t m = 0; m < 100; ++m) {
      for (std::size_t record = 0; record < 4; ++record) {
        const Eigen::Map<const Eigen::Array4d> found(&all[(m * 4 + record) * 4]);
        const int step = example.options.records[record];
        if (is_clean_until(paths[m], step, 6)) {
          const PhaseState& state = paths[m].path.states[static_cast<std::size_t>(step)];
          EXPECT_LT((found - Eigen::Array4d(state.q(0), state.q(1), state.p(0), state.p(1))).abs().maxCoeff(), 1e-9);
        } else {
          EXPECT_TRUE(found.isNaN().all()) << m << ", " << step;
        }
      }
    }
    example.options.keep = KeepStates::kFinal;
    EXPECT_EQ(example.options.kept_numbers(example.start), 4);
    const std::vector<double> last = example.sums().states;
    ASSERT_EQ(last.size(), 400U);
    for (std::size_t m = 0; m < 100; ++m)
      EXPECT_EQ(std::memcmp(&last[4 * m], &all[16 * m + 12], 4 * sizeof(double)), 0) << m;
    example.options.keep = KeepStates::kNone;
    EXPECT_TRUE(example.sums().states.empty());
  }
}

}  // namespace
}  // namespace pulson::ensemble
