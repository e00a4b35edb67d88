// Matches foretold against functions that the interpolation reproduces, and against what it leaves.

#include "known_matches.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace pulson::compare {
namespace {

using Eigen::VectorXd;

// Of one shape, three numbers: of the first degree in the two of x, of the second, and neither.
VectorXd of_shape(const VectorXd& x) {
  return VectorXd{{2 + x[0] - 3 * x[1], x[0] * x[1] - x[1] * x[1], std::sin(x[0]) * std::exp(0.3 * x[1])}};
}

KnownMatches known_on_a_grid(int size, double spacing) {
  KnownMatches known;
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < size; ++j) {
      const VectorXd x{{spacing * i, spacing * j}};
      known.add(x, {of_shape(x), -of_shape(x)});
    }
  return known;
}

TEST(KnownMatches, AreForetoldBetweenPlaces) {
  const KnownMatches known = known_on_a_grid(4, 0.4);
  const VectorXd x{{0.55, 0.7}};
  const std::vector<VectorXd> foretold = known.at(x);
  ASSERT_EQ(foretold.size(), 2U);
  EXPECT_NEAR(foretold[0][0], of_shape(x)[0], 1e-10);
  EXPECT_NEAR(foretold[0][1], of_shape(x)[1], 1e-10);
  EXPECT_NEAR(foretold[0][2], of_shape(x)[2], 3e-3);
  EXPECT_NEAR((foretold[0] + foretold[1]).norm(), 0, 1e-10);
}

TEST(KnownMatches, AreThoseOfAPlaceThatIsKnown) {
  const KnownMatches known = known_on_a_grid(3, 0.4);
  const VectorXd x{{0.4, 0.8}};
  EXPECT_NEAR((known.at(x)[0] - of_shape(x)).norm(), 0, 1e-10);
}

TEST(KnownMatches, AreNotForetoldByTooFewOrFarAway) {
  KnownMatches known;
  EXPECT_TRUE(known.at(VectorXd::Zero(2)).empty());
  for (const double t : {0.0, 0.1}) known.add(VectorXd{{t, 0}}, {of_shape(VectorXd{{t, 0}})});
  EXPECT_TRUE(known.at(VectorXd{{0.05, 0}}).empty());
  EXPECT_TRUE(known_on_a_grid(3, 0.4).at(VectorXd{{50, -50}}).empty());
}

}  // namespace
}  // namespace pulson::compare
