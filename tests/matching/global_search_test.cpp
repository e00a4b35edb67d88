// The least of the minima of several searches, and the paths that they begin with.

#include "global_search.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "path_examples.hpp"
#include "path_starts.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

// Two pairs whose least J, kFirstCost and kSecondCost, is known from L-BFGS over nodes in numpy, from straight paths
// down from β = 1 and from bent ones. One search from landmarks at rest ends at 9.9575 and 10.7849, minima of numpy's,
// too.
PathMatch first_pair(double beta = 0) {
  return {Points{{0.73, 0.04, -1.07, -0.22}, {0.74, -0.51, -0.28, -1.09}},
          Points{{-1.08, 0.37, -0.16, 0.95}, {1.2, -0.64, 1.14, 0.83}},
          "gaussian:alpha=1",
          beta > 0 ? ch_sd(beta) : "none",
          {1, 20},
          0.01};
}

PathMatch second_pair(double beta = 0) {
  PathMatch match = first_pair(beta);
  match.source = Points{{0.24, 0.94, 0.27, -0.96}, {1.15, -0.62, 1.01, 0.85}};
  match.target = Points{{-0.25, -0.43, 0.02, 0.62}, {0.68, 0.3, -0.95, 0.78}};
  return match;
}

constexpr double kFirstCost = 8.1413, kSecondCost = 9.6705;
constexpr double kDigits = 1e-4;  // of them
constexpr double kSame = 1e-3;    // of J

PathSolution least_minimum(const MatchingProblem& problem) {
  PathSolution found = search_globally(problem, {}, Finish::kNoSaddle);
  EXPECT_TRUE(found.converged) << found.reason;
  return found;
}

TEST(GlobalSearch, FindsTheLeastMinimumWhereOneSearchDoesNot) {
  const PathSolution first = least_minimum(first_pair().problem());
  EXPECT_NEAR(first.cost.total(), kFirstCost, kDigits);
  const Points momenta{{-2.2634, 3.2061, 1.6108, -3.0179}, {1.5569, -1.5328, -0.0652, 1.5546}};
  EXPECT_LE((first.momenta - momenta).norm(), 0.01 * momenta.norm());
  EXPECT_NEAR(least_minimum(second_pair().problem()).cost.total(), kSecondCost, kDigits);
}

TEST(GlobalSearch, ListsMinimaWithTheRecordedOneFirst) {
  for (const PathMatch& match : {first_pair(), second_pair()}) {
    const PathSolution found = least_minimum(match.problem());
    ASSERT_GE(found.minima.size(), 2U);
    EXPECT_EQ(found.minima.front().total, found.cost.total());
    EXPECT_EQ(found.minima.front().log_weight, 0);
    const auto in_order = [](const Minimum& a, const Minimum& b) { return a.total < b.total; };
    EXPECT_TRUE(std::is_sorted(found.minima.begin() + 1, found.minima.end(), in_order));
    for (const Minimum& minimum : found.minima) {
      EXPECT_GE(minimum.found, 1);
      EXPECT_NEAR(minimum.log_weight, found.cost.total() - minimum.total, 1e-12);
    }
  }
}

// A path costs no less at a smaller β, so the least J does not either.
TEST(GlobalSearch, CostFallsAsNoiseGrows) {
  for (const auto& pair : {first_pair, second_pair}) {
    double before = kInfinity;
    for (const double beta : {0.0, 0.01, 0.03, 0.1, 0.3}) {
      const double cost = least_minimum(pair(beta).problem()).cost.total();
      EXPECT_LE(cost, (1 + kSame) * before) << beta;
      before = cost;
    }
  }
}

TEST(GlobalSearch, FindsTheLeastMinimumOfAPermutationOnALine) {
  PathMatch match{Points{{1.19, 1.96, 2.60, 3.31, 4.29, 5.48, 6.73}},
                  Points{{2.50, 3.39, 1.98, 6.89, 5.67, 1.23, 4.22}},
                  "gaussian:alpha=1",
                  ch_sd(0.2),
                  {1, 20},
                  0.01};
  EXPECT_LE(least_minimum(match.problem()).cost.total(), 45.1);
}

TEST(GlobalSearch, HasTheSameBitsForAnyNumberOfThreads) {
  const MatchingProblem problem = second_pair(0.03).problem();
  set_thread_count(1);
  const PathSolution one = least_minimum(problem);
  set_thread_count(2);
  const PathSolution two = least_minimum(problem);
  set_thread_count(0);
  EXPECT_EQ(one.momenta, two.momenta);
  EXPECT_EQ(one.cost.total(), two.cost.total());
  EXPECT_EQ(one.iterations, two.iterations);
  ASSERT_EQ(one.minima.size(), two.minima.size());
  for (std::size_t i = 0; i < one.minima.size(); ++i) {
    EXPECT_EQ(one.minima[i].total, two.minima[i].total);
    EXPECT_EQ(one.minima[i].found, two.minima[i].found);
  }
}

// Each of the searches that are under way asks once more.
TEST(GlobalSearch, EndsWhereItIsInterrupted) {
  const MatchingProblem problem = first_pair().problem();
  set_thread_count(1);
  for (const int most : {0, 5, 60}) {
    int asked = 0;
    MinimiseOptions options;
    options.interrupted = [&] { return ++asked > most; };
    const PathSolution found = search_globally(problem, options, Finish::kNoSaddle);
    EXPECT_LE(asked, most + 40);
    EXPECT_TRUE(std::isfinite(found.cost.total()));
    EXPECT_FALSE(found.minima.empty());
    if (most < 10) {
      EXPECT_FALSE(found.converged);
    }
  }
  set_thread_count(0);
}

// Targets that lie where the path ends anyhow cost nothing more.
TEST(GlobalSearch, OfPartialDataLeavesOutWhatIsMissing) {
  PathMatch match = second_pair();
  MatchingProblem problem = match.problem();
  Points target = match.target;
  target(0, 2) = target(1, 2) = target(1, 3) = kNaN;
  problem.data = std::make_shared<LandmarkTerm>(LandmarkObservations{target, match.sigma});
  const PathSolution found = least_minimum(problem);
  EXPECT_LT(found.cost.total(), kSecondCost);
  const Points end = found.path.end();
  match.target = target.array().isNaN().select(end, target);
  EXPECT_NEAR(least_minimum(match.problem()).cost.total(), found.cost.total(), kSame * kSecondCost);
}

// What can be done in a plane of space can be done in space.
TEST(GlobalSearch, InSpaceFindsNoMoreThanInAPlane) {
  for (const PathMatch& plane : {first_pair(), second_pair()}) {
    PathMatch match = plane;
    const Eigen::Matrix<double, 3, 2> axes{{2.0 / 3, -1.0 / 3}, {2.0 / 3, 2.0 / 3}, {1.0 / 3, -2.0 / 3}};
    match.source = axes * plane.source;
    match.target = axes * plane.target;
    EXPECT_LE(least_minimum(match.problem()).cost.total(), (1 + kSame) * least_minimum(plane.problem()).cost.total());
  }
}

// Of 350 landmarks few are looked at.
TEST(GlobalSearch, OfASmoothDeformationOfManyLandmarksFindsWhatOneSearchFinds) {
  PathMatch match;
  match.source.resize(2, 350);
  match.target.resize(2, 350);
  for (int a = 0; a < 350; ++a) {
    const double angle = 2 * std::numbers::pi * a / 350, radius = 1 + 0.2 * std::cos(3 * angle);
    match.source.col(a) << std::cos(angle), std::sin(angle);
    match.target.col(a) << 1.2 * radius * std::cos(angle), radius * std::sin(angle);
  }
  match.grid.steps = 4;
  match.sigma = 0.02;
  const PathSolution one = search_paths(match.problem(), {}, nullptr, Finish::kNoSaddle);
  const PathSolution found = least_minimum(match.problem());
  EXPECT_EQ(found.cost.total(), one.cost.total());
  EXPECT_EQ(found.minima.size(), 1U);
  EXPECT_EQ(found.minima.front().found, 2);
}

MatchingProblem partly_observed(int d) {
  PathMatch match = nearby_shapes("none", d);
  match.grid.steps = 6;
  MatchingProblem problem = match.problem();
  Points target = match.target;
  target(d - 1, 1) = kNaN;
  problem.data = std::make_shared<LandmarkTerm>(LandmarkObservations{target, match.sigma});
  return problem;
}

Points ends_of(const MatchingProblem& problem) {
  Points end = problem.data->landmarks()->target();
  end(end.rows() - 1, 1) = problem.source(end.rows() - 1, 1);
  return end;
}

TEST(PathStarts, GoStraightToTheTargets) {
  for (const int d : {1, 2, 3}) {
    const MatchingProblem problem = partly_observed(d);
    const std::vector<Points> nodes = straight_path(problem);
    ASSERT_EQ(nodes.size(), 7U);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double t = static_cast<double>(k) / 6;
      EXPECT_LE(largest(nodes[k] - (1 - t) * problem.source - t * ends_of(problem)), 1e-15);
    }
  }
}

// Half way they are beside the straight path by 0.4 or 0.8 of the displacement, at a right angle but on a line.
TEST(PathStarts, BendHalfWay) {
  for (const int d : {1, 2, 3}) {
    const MatchingProblem problem = partly_observed(d);
    const Points way = ends_of(problem) - problem.source, middle = straight_path(problem)[3];
    for (int index = 0; index < 12; ++index) {
      SCOPED_TRACE(fmt::format("bend {} in {}D", index, d));
      const std::vector<Points> nodes = bent_path(problem, index, 1);
      EXPECT_EQ(nodes.front(), problem.source);
      EXPECT_LE(largest(nodes.back() - ends_of(problem)), 1e-14);
      const Points bend = nodes[3] - middle;
      for (Eigen::Index a = 0; a < way.cols(); ++a) {
        const double part = bend.col(a).norm() / std::max(way.col(a).norm(), 1e-300);
        EXPECT_LE(part, 0.8 + 1e-12);
        if (d > 1) {
          EXPECT_NEAR(bend.col(a).dot(way.col(a)), 0, 1e-14);
        }
        if (d < 3 && way.col(a).norm() > 0) {
          EXPECT_TRUE(std::abs(part - 0.4) < 1e-12 || std::abs(part - 0.8) < 1e-12) << part;
        }
      }
      EXPECT_EQ(bent_path(problem, index, 1)[2], nodes[2]);
    }
  }
}

TEST(PathStarts, BendToEitherSideFirst) {
  const MatchingProblem problem = partly_observed(2);
  const std::vector<Points> straight = straight_path(problem), left = bent_path(problem, 0, 1),
                            right = bent_path(problem, 1, 1);
  for (std::size_t k = 0; k < straight.size(); ++k) EXPECT_LE(largest(left[k] + right[k] - 2 * straight[k]), 1e-14);
}

}  // namespace
}  // namespace pulson::matching
