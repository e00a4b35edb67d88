#include "accurate_paths.hpp"

#include <gtest/gtest.h>

#include "path_examples.hpp"

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

}  // namespace
}  // namespace pulson::matching
