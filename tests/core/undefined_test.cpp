#include "core/undefined.hpp"

#include <gtest/gtest.h>

namespace pulson {
namespace {

TEST(Undefined, IsNotPassedOver) {
  EXPECT_EQ(max_or_undefined(1, 2), 2);
  EXPECT_EQ(min_or_undefined(1, 2), 1);
  for (const auto& [a, b] : {std::pair(kUndefined, 1.0), {1.0, kUndefined}}) {
    EXPECT_TRUE(std::isnan(max_or_undefined(a, b)));
    EXPECT_TRUE(std::isnan(min_or_undefined(a, b)));
  }
}

// (1 − p)^n = 0.05 at the bound, which is nearly 3/n.
TEST(Undefined, UnseenEventsHaveABound) {
  for (const double trials : {1.0, 20.0, 1e4}) EXPECT_NEAR(std::pow(1 - unseen_below(trials), trials), 0.05, 1e-12);
  EXPECT_NEAR(unseen_below(1e6) * 1e6, 3, 0.01);
}

}  // namespace
}  // namespace pulson
