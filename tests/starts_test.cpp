// Where searches begin: several ways, and what they find.

#include <cmath>
#include <numbers>

#include "combinations.hpp"
#include "match.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Two squares of side 2·`half`, `apart` from centre to centre, that change places by half a turn about the origin.
Match exchange(double half, double apart) {
  Match match;
  match.source.resize(2, 8);
  int a = 0;
  for (const double side : {-1.0, 1.0})
    for (const double x : {-half, half})
      for (const double y : {-half, half}) match.source.col(a++) << side * apart / 2 + x, y;
  match.target = -match.source;
  return match;
}

// The angle by which the centre of the first square turns about the origin, to the left.
double turn(const Trajectory& path) {
  double angle = 0;
  for (std::size_t k = 1; k < path.states.size(); ++k) {
    const Eigen::Vector2d from = path.states[k - 1].q.leftCols(4).rowwise().mean();
    const Eigen::Vector2d to = path.states[k].q.leftCols(4).rowwise().mean();
    angle += std::atan2(from.x() * to.y() - from.y() * to.x(), from.dot(to));
  }
  return angle;
}

// Momenta mirrored in the x axis, which maps the squares on themselves.
Points mirrored(const Match& match, Points p) {
  p.row(1) *= -1;
  Points moved(2, p.cols());
  for (Index a = 0; a < p.cols(); ++a) {
    const Eigen::Vector2d place(match.source(0, a), -match.source(1, a));
    Index b = 0;
    (match.source.colwise() - place).colwise().norm().minCoeff(&b);
    moved.col(b) = p.col(a);
  }
  return moved;
}

// The squares can turn round each other to the left or to the right, at the same cost.
TEST(Starts, FindBothWaysRoundOfTwoSquares) {
  const Match match = exchange(0.2, 1);
  const MatchingObjective objective = match.objective();
  const MinimiseSummary summary = minimum(match, with_starts(3));
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_EQ(searches(summary), 3);
  ASSERT_GE(summary.minima.size(), 2U);
  const Minimum& first = summary.minima[0];
  const Minimum& second = summary.minima[1];
  EXPECT_TRUE(first.converged);
  EXPECT_TRUE(second.converged);
  EXPECT_EQ(first.cost.total(), summary.solution.cost.total());
  EXPECT_NEAR(first.cost.total(), second.cost.total(), 1e-5 * first.cost.total());
  EXPECT_NEAR(std::abs(turn(summary.solution.path())), std::numbers::pi, 0.15);

  // The second is not the first once more: the first, mirrored, is a minimum of that cost with the opposite turn.
  const Points p = mirrored(match, objective.momenta(summary.solution.z));
  const auto other = objective.evaluate(objective.white(p, MatrixXd::Zero(0, match.grid.steps)));
  ASSERT_TRUE(other.has_value());
  EXPECT_NEAR(other->cost.total(), second.cost.total(), 1e-5 * second.cost.total());
  EXPECT_NEAR(turn(other->path()), -turn(summary.solution.path()), 1e-6);
}

// Way 1 turns to the left and way 2 to the right: one start more finds the other.
TEST(Starts, TurnTheFirstWayToTheLeft) {
  const MinimiseSummary two = minimum(exchange(0.2, 1), with_starts(2));
  EXPECT_EQ(two.start, "way 2");
  EXPECT_EQ(searches(two), 2);
  EXPECT_NEAR(turn(two.solution.path()), std::numbers::pi, 0.15);
}

TEST(Starts, AreSortedByTheirCosts) {
  const MinimiseSummary summary = minimum(exchange(0.2, 1), with_starts(4));
  EXPECT_EQ(searches(summary), 4);
  for (std::size_t i = 1; i < summary.minima.size(); ++i)
    EXPECT_LE(summary.minima[i - 1].cost.total(), summary.minima[i].cost.total());
}

// Where there is but one minimum, all find it; noise in the positions adds a start.
TEST(Starts, AreCountedAtTheirMinimum) {
  Match match;
  match.source = Numbers(2).landmarks(2, 4);
  match.target = match.source.array() + 0.05;
  MinimiseOptions options = with_starts(3);
  options.gradient_tolerance = 1e-6;
  const MinimiseSummary quiet = minimum(match, options);
  ASSERT_EQ(quiet.minima.size(), 1U);
  EXPECT_EQ(quiet.minima[0].found, 3);
  match.noise = "ch-sd:beta=0.3";
  EXPECT_EQ(searches(minimum(match, options)), 4);
}

// Squares that are small beside the kernel, and data that are held firmly: the flow's start is out of bounds, and the
// search from rest gets stuck.
Match stiff_exchange() {
  Match match = exchange(0.1, 1);
  match.kernel = "gaussian:alpha=0.5";
  match.sigma = 0.05;
  return match;
}

TEST(Ways, AreTriedWhereShapesStayApart) {
  const Match match = stiff_exchange();
  const MatchingObjective objective = match.objective();
  const MinimiseSummary summary = minimise(objective, {});
  EXPECT_TRUE(summary.start == "way 2" || summary.start == "way 3") << summary.start;
  EXPECT_TRUE(summary.converged) << summary.reason;
  EXPECT_NEAR(std::abs(turn(summary.solution.path())), std::numbers::pi, 0.1);
  EXPECT_EQ(searches(summary), 3);
}

}  // namespace
}  // namespace pulson
