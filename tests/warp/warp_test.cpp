// The triangles that show where a map folds.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace pulson::warp {
namespace {

double twice_area(const Points& x, const std::array<int, 3>& t) {
  const Eigen::Vector2d u = x.col(t[1]) - x.col(t[0]);
  const Eigen::Vector2d v = x.col(t[2]) - x.col(t[0]);
  return u.x() * v.y() - u.y() * v.x();
}

// The triangles, after checking that each is positive and that together they have the given area.
std::vector<std::array<int, 3>> checked_triangles(const Points& points, double area) {
  std::vector<std::array<int, 3>> triangles = delaunay_triangles(points);
  double sum = 0;
  for (const std::array<int, 3>& triangle : triangles) {
    EXPECT_GT(twice_area(points, triangle), 0);
    sum += twice_area(points, triangle) / 2;
  }
  EXPECT_NEAR(sum, area, 1e-12 * area);
  return triangles;
}

Points grid(int columns, int rows) {
  Points points(2, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) points.col(row * columns + column) << column, row;
  return points;
}

Points regular_polygon(int count) {
  Points points(2, count);
  for (int i = 0; i < count; ++i)
    points.col(i) << std::cos(2 * std::numbers::pi * i / count), std::sin(2 * std::numbers::pi * i / count);
  return points;
}

TEST(DelaunayTriangles, CoverTheHull) {
  EXPECT_EQ(checked_triangles((Points(2, 3) << 0, 1, 0, 0, 0, 1).finished(), 0.5).size(), 1U);
  EXPECT_EQ(checked_triangles((Points(2, 5) << 0, 2, 2, 0, 1, 0, 0, 2, 2, 1).finished(), 4).size(), 4U);
  EXPECT_EQ(checked_triangles((Points(2, 4) << 0, 2, 2.5, 0, 0, 0, 2, 1).finished(), 3.25).size(), 2U);
}

TEST(DelaunayTriangles, CoverTheHullOfCocircularPoints) {
  EXPECT_EQ(checked_triangles(grid(2, 2), 1).size(), 2U);
  EXPECT_EQ(checked_triangles(grid(5, 4), 12).size(), 24U);
  for (const int count : {5, 6, 12, 64}) {
    const double area = 0.5 * count * std::sin(2 * std::numbers::pi / count);
    for (const double offset : {0.0, 100.0})
      EXPECT_EQ(checked_triangles(regular_polygon(count).array() + offset, area).size(),
                static_cast<std::size_t>(count - 2))
          << count << ", " << offset;
  }
}

TEST(DelaunayTriangles, HaveEmptyCircumcircles) {
  Points points = random_points(2, 60, 1);
  points.leftCols(4) << -1, 1, 1, -1, -1, -1, 1, 1;
  for (const double offset : {0.0, 100.0}) {
    const Points moved = points.array() + offset;
    for (const std::array<int, 3>& t : checked_triangles(moved, 4)) {
      Eigen::Matrix2d edges;
      edges << (moved.col(t[1]) - moved.col(t[0])).transpose(), (moved.col(t[2]) - moved.col(t[0])).transpose();
      const Eigen::Vector2d center =
          edges.partialPivLu().solve(Eigen::Vector2d(0.5 * edges.rowwise().squaredNorm())) + moved.col(t[0]);
      const double radius = (moved.col(t[0]) - center).norm();
      EXPECT_GE((moved.colwise() - center).colwise().norm().minCoeff(), radius * (1 - 1e-9));
    }
  }
}

TEST(DelaunayTriangles, AreNoneWhereAllPointsLieOnALine) {
  for (const int count : {0, 1, 2}) EXPECT_TRUE(delaunay_triangles(Points::Zero(2, count)).empty()) << count;
  for (const int count : {3, 4, 9}) {
    const Eigen::RowVectorXd t = Eigen::RowVectorXd::LinSpaced(count, 0, 1);
    Points line(2, count);
    line << t, 0 * t;
    EXPECT_TRUE(delaunay_triangles(line).empty()) << count;
    line << t, t;
    EXPECT_TRUE(delaunay_triangles(line).empty()) << count;
    EXPECT_TRUE(delaunay_triangles(Points::Ones(2, count)).empty()) << count;
  }
}

TEST(DelaunayTriangles, SurviveDuplicates) {
  Points points(2, 10);
  points << grid(3, 3), Eigen::Vector2d(1, 1);
  checked_triangles(points, 4);
  points.col(9) << 0, 0;
  checked_triangles(points, 4);
  Points pairs(2, 8);
  pairs << grid(2, 2), grid(2, 2);
  checked_triangles(pairs, 1);
}

TEST(FlippedTriangles, CountsReversedOrientation) {
  const Points before = grid(5, 4);
  EXPECT_EQ(flipped_triangles(before, before), 0);
  EXPECT_EQ(flipped_triangles(before, 3 * before.array() + 1), 0);
  EXPECT_EQ(flipped_triangles(before, Eigen::Vector2d(-1, 1).asDiagonal() * before), 24);
  Points after = before;
  after.col(6) << -1, 1;  // (1, 1) pulled out over the edge x = 0
  EXPECT_GT(flipped_triangles(before, after), 0);
  EXPECT_LT(flipped_triangles(before, after), 24);
}

}  // namespace
}  // namespace pulson::warp
