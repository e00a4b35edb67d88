// J(β) as the noise vanishes.

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

RegistrationOptions options_with(const std::string& noise) {
  RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.noise = noise;
  options.lambda = 1;
  options.sigma = 0.01;
  options.align = AlignmentKind::kNone;
  return options;
}

std::vector<HomotopyStep> follow(const Points& source, const Points& target, const RegistrationOptions& options) {
  const Landmarks a = shape(source), b = shape(target);
  return follow_homotopy(a, b, options, register_shapes(a, b, options));
}

TEST(Homotopy, OfASwapGrowsAsTheNoiseVanishes) {
  const Points source{{0, 1}}, target{{1, 0}};
  const std::vector<HomotopyStep> steps = follow(source, target, options_with("ch-sd:beta=1"));
  ASSERT_EQ(steps.size(), 11U);
  EXPECT_EQ(steps.front().beta, 1);
  EXPECT_EQ(steps.back().beta, 1.0 / 1024);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    SCOPED_TRACE(steps[k].beta);
    EXPECT_TRUE(steps[k].converged);
    if (k > 0) {
      EXPECT_GT(steps[k].cost.total(), steps[k - 1].cost.total());
    }
  }
  EXPECT_FALSE(reaches_diffeomorphism(steps));
  EXPECT_NEAR(steps.back().cost.total() / steps[9].cost.total() - 1, steps.back().growth(),
              0.2 * steps.back().growth());
  for (const std::size_t k : {0U, 1U, 2U}) {
    const RegistrationOptions options = options_with("ch-sd:beta=" + std::to_string(steps[k].beta));
    const Registration alone = register_shapes(shape(source), shape(target), options);
    EXPECT_NEAR(steps[k].cost.total(), alone.cost.total(), 1e-5 * alone.cost.total());
  }
}

// Branches of minima cross: in single searches downwards J(0.2) is 51.5 here, where another path costs 45.1.
TEST(Homotopy, IsTheLowerEnvelopeOfAllBranches) {
  const Points source{{1.19, 1.96, 2.60, 3.31, 4.29, 5.48, 6.73}}, target{{2.50, 3.39, 1.98, 6.89, 5.67, 1.23, 4.22}};
  const std::vector<HomotopyStep> steps = follow(source, target, options_with("ch-sd:beta=0.4"));
  for (std::size_t k = 1; k < steps.size() && steps[k].matched; ++k) {
    SCOPED_TRACE(steps[k].beta);
    EXPECT_GE(steps[k].cost.total(), 0.999 * steps[k - 1].cost.total());
  }
  for (const std::size_t k : {1U, 3U}) {
    const RegistrationOptions options = options_with(fmt::format("ch-sd:beta={}", steps[k].beta));
    const Registration alone = register_shapes(shape(source), shape(target), options);
    SCOPED_TRACE(steps[k].beta);
    EXPECT_LE(steps[k].cost.total(), (1 + 1e-5) * alone.cost.total());
  }
  EXPECT_LT(steps[1].cost.total(), 45.1);
  EXPECT_TRUE(steps[3].matched);
  EXPECT_FALSE(steps.back().matched) << "landmarks on a line have no diffeomorphism that changes their order";
  EXPECT_FALSE(steps.back().unmatched.empty());
  EXPECT_TRUE(steps.front().unmatched.empty());
  EXPECT_FALSE(reaches_diffeomorphism(steps));
}

// Two halves of 300 landmarks that slide along each other, with 13 pairs across the line between them.
TEST(Homotopy, NamesTheLandmarksThatNoFlowParts) {
  Points source = Points::Random(2, 600), target = source;
  source.row(1).head(300) = source.row(1).head(300).cwiseAbs().array() + 0.1;
  source.row(1).tail(300) = -source.row(1).tail(300).cwiseAbs().array() - 0.1;
  std::vector<int> pairs;
  for (int a = 0; a < 13; ++a) {
    source.col(20 * a) << -1 + a / 6.0, 0;
    source.col(300 + 20 * a) = source.col(20 * a);
    pairs.push_back(20 * a);
  }
  for (int a = 0; a < 13; ++a) pairs.push_back(300 + 20 * a);
  target = source;
  target.row(0).head(300).array() += 0.01;
  target.row(0).tail(300).array() -= 0.01;
  EXPECT_EQ(impossible_landmarks(source, target), pairs);
  EXPECT_EQ(impossible_landmarks(target, source), pairs) << "nor joins";
  target(0, 0) = std::nan("");
  EXPECT_EQ(impossible_landmarks(source, target).size(), 24U);
  EXPECT_TRUE(impossible_landmarks(source, source).empty());
  EXPECT_EQ(impossible_landmarks(Points{{0, 1, 2, 3, 3}}, Points{{0, 2, 1, 3, 4}}), (std::vector{1, 2, 3, 4}));
}

// Without carriers, as of landmarks whose own noise is all that counts.
TEST(Homotopy, FollowsManyLandmarksWithLargeNoise) {
  const Points source = Points::Random(2, 320);
  Points target = source;
  target.row(0).array() += 0.05 * source.row(1).array();
  RegistrationOptions options = options_with("ch-sd:beta=100");
  options.grid.steps = 2;
  EXPECT_TRUE(register_shapes(shape(source), shape(target), options).matched());
}

// Where the first noise is large, the last still costs some per cent, and ever less: two wings that LDDMM matches.
TEST(Homotopy, SettlesWhereTheActionFalls) {
  std::vector<HomotopyStep> steps{{0.312, {5.51, 1.14, 7.56}, 0.73, true, true, 3},
                                  {0.156, {6.01, 0.33, 8.79}, 0.79, true, true, 3}};
  EXPECT_GT(steps.back().growth(), 0.02);
  EXPECT_TRUE(reaches_diffeomorphism(steps));
  steps.front().cost.action = 0.3;
  EXPECT_FALSE(reaches_diffeomorphism(steps)) << "it grows by as much again and again";
  steps = {steps.back()};
  EXPECT_FALSE(reaches_diffeomorphism(steps));
}

TEST(Homotopy, OfADiffeomorphicPairTendsToLddmm) {
  const Points source{{0, 1, 0.4}, {0, 0.1, 0.9}}, target{{0.1, 1.2, 0.3}, {-0.1, 0.2, 1.1}};
  const std::vector<HomotopyStep> steps = follow(source, target, options_with("ch-sd:beta=0.5"));
  for (const HomotopyStep& step : steps) EXPECT_TRUE(step.matched);
  EXPECT_EQ(least_needed(steps)->beta, steps.back().beta);
  EXPECT_TRUE(reaches_diffeomorphism(steps));
  RegistrationOptions limit = options_with("none");
  limit.integrator = "midpoint";
  const double cost = register_shapes(shape(source), shape(target), limit).cost.total();
  EXPECT_NEAR(steps.back().cost.total(), cost, 1e-4 * cost);
  EXPECT_LT(steps.front().cost.total(), 0.9 * cost);
}

TEST(Homotopy, NeedsMetamorphosis) {
  const Landmarks a = shape(Points{{0, 1}}), b = shape(Points{{0, 2}});
  for (const std::string noise : {"none", "trouve-vialard:sigma=1"})
    EXPECT_THROW(require_homotopy(a, b, options_with(noise)), InputError);
  EXPECT_NO_THROW(require_homotopy(a, b, options_with("ch-sd:beta=1")));
}

}  // namespace
}  // namespace pulson::matching
