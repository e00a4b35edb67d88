#include "accurate_paths.hpp"

#include <gtest/gtest.h>

#include "path_examples.hpp"
#include "pulson/matching/registration.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

constexpr int kSteps = 5;

TEST(AccuratePaths, TakeAsManyStepsAsTheCostNeeds) {
  const PathSolution bent = search_accurate_paths(swap_on_a_line(0.2, 1, kSteps).problem(), {});
  EXPECT_GT(bent.path.grid.steps, kSteps);
  EXPECT_LE(bent.path.grid.steps, kMostSteps * kSteps);
  EXPECT_EQ(bent.states.size(), static_cast<std::size_t>(bent.path.grid.steps) + 1);
  EXPECT_EQ(bent.increments.cols(), bent.path.grid.steps);
  EXPECT_NEAR(bent.cost.total(), swap_cost(0.2, 1), kAccurate * swap_cost(0.2, 1));
}

TEST(AccuratePaths, KeepTheStepsThatAreEnough) {
  const PathSolution straight = search_accurate_paths(swap_on_a_line(2, 1, kSteps).problem(), {});
  EXPECT_EQ(straight.path.grid.steps, kSteps);
  EXPECT_NEAR(straight.cost.total(), swap_cost(2, 1), kAccurate * swap_cost(2, 1));
}

// Pairs so far apart that each changes places by itself; so many are solved by sweeps.
TEST(AccuratePaths, TakeAsManyAlongALine) {
  constexpr int kPairs = 32;
  const auto pairs = [](int count) {
    PathMatch match{Points(1, 2 * count), Points(1, 2 * count), "matern32:alpha=1", ch_sd(0.2), {1, kSteps}};
    for (int i = 0; i < count; ++i) {
      match.source.middleCols(2 * i, 2) << 100 * i, 100 * i + 1;
      match.target.middleCols(2 * i, 2) << 100 * i + 1, 100 * i;
    }
    return search_accurate_paths(match.problem(), {});
  };
  const PathSolution one = pairs(1), all = pairs(kPairs);
  EXPECT_GT(one.path.grid.steps, kSteps);
  EXPECT_EQ(all.path.grid.steps, one.path.grid.steps);
  EXPECT_NEAR(all.cost.total(), kPairs * one.cost.total(), 1e-6 * all.cost.total());
}

// The searches for minima take the steps of the grid, the path that is recorded more.
TEST(AccuratePaths, MinimaAreInProportionToTheRecordedCost) {
  const Points source{{0, 1}, {0, 0}}, target{{1, 0}, {0.1, 0.1}};
  RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.noise = "ch-sd:beta=0.2";
  options.sigma = 0.01;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  options.grid.steps = kSteps;
  const std::vector<Minimum> coarse = register_shapes(shape(source), shape(target), options).minima;
  options.more_steps = true;
  const Registration fine = register_shapes(shape(source), shape(target), options);
  ASSERT_GT(fine.grid.steps, kSteps);
  ASSERT_GE(fine.minima.size(), 2U);
  ASSERT_EQ(fine.minima.size(), coarse.size());
  EXPECT_EQ(fine.minima[0].total, fine.cost.total());
  EXPECT_NE(fine.minima[0].total, coarse[0].total);
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    EXPECT_NEAR(fine.minima[i].total / fine.minima[0].total, coarse[i].total / coarse[0].total, 1e-12);
    EXPECT_NEAR(fine.minima[i].log_weight, fine.minima[0].total - fine.minima[i].total, 1e-9);
  }
}

}  // namespace
}  // namespace pulson::matching
