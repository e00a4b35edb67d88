// The motion of the whole space under a landmark path, and the triangles that tell where it folds.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "pulson/warp/triangulation.hpp"

namespace pulson {
namespace {

// ---- material flow

struct Motion {
  StochasticSystem system;
  Trajectory path;

  MaterialFlow flow() const { return {system, path}; }
};

Motion move(const std::string& integrator, const StochasticSystem& system, const PhaseState& initial,
            const TimeGrid& grid, const Eigen::MatrixXd& increments) {
  return {system, make_integrator(integrator)->integrate(system, initial, grid, increments)};
}

// Seven landmarks about half a unit apart, in every dimension.
Points spread_landmarks(int dimension) {
  Points q = 0.1 * random_points(dimension, 7, 5);
  for (int a = 0; a < 7; ++a) {
    q(0, a) += dimension == 1 ? 0.5 * a : 0.8 * std::cos(a * 2 * std::numbers::pi / 7);
    if (dimension > 1) q(1, a) += 0.8 * std::sin(a * 2 * std::numbers::pi / 7);
  }
  return q;
}

class MaterialFlowContract : public testing::TestWithParam<std::tuple<std::string, DefinedKernel, int>> {
 protected:
  const std::string integrator_ = std::get<0>(GetParam());
  const KernelOperator kernel_ = std::get<1>(GetParam()).make();
  const int d_ = std::get<2>(GetParam());
  const Points q0_ = spread_landmarks(d_);

  // From random momenta for which the first step has κ = 0.1; peakons that run into each other end in a collision.
  Motion motion(const std::string& noise) const {
    Landmarks shape;
    shape.points = q0_;
    const StochasticSystem system{kernel_, make_noise(noise, shape)};
    const TimeGrid grid{1, 20};
    const Points p0 = random_points(d_, 7, 2);
    const double kappa = contraction_bound(kernel_, p0, grid.dt());
    const int channels = system.noise->channels(d_, 7);
    return move(integrator_, system, {q0_, 0.1 / kappa * p0}, grid,
                std::sqrt(grid.dt()) * random_points(channels, grid.steps, 9));
  }

  // Simplices so small that the map is linear on them.
  void expect_orientation(const MaterialFlow& flow) const {
    const Points labels = 2 * random_points(d_, 500, 3);
    const double edge = 1e-6;
    const Points corner = flow.end(labels);
    std::vector<Points> edges;
    for (int axis = 0; axis < d_; ++axis)
      edges.emplace_back(flow.end(labels.colwise() + edge * Eigen::VectorXd::Unit(d_, axis)) - corner);
    for (Eigen::Index m = 0; m < labels.cols(); ++m) {
      Eigen::MatrixXd gradient(d_, d_);
      for (int axis = 0; axis < d_; ++axis) gradient.col(axis) = edges[static_cast<std::size_t>(axis)].col(m) / edge;
      EXPECT_GT(gradient.determinant(), 0) << labels.col(m).transpose();
    }
  }
};

std::vector<std::string> integrators_with_a_map() { return {"variational", "variational-paper"}; }

INSTANTIATE_TEST_SUITE_P(Tables, MaterialFlowContract,
                         testing::Combine(testing::ValuesIn(integrators_with_a_map()),
                                          testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param) + "_" + std::get<1>(instance.param).spec() +
                                            "_in_" + std::to_string(std::get<2>(instance.param)) + "d");
                         });

TEST_P(MaterialFlowContract, CarriesLandmarksOntoTheirOwnPath) {
  for (const std::string noise : {"none", "ch-sd:beta=0.5", "ch-sd:beta=2,on=2/3", "p-sd:beta=0.3,fields=grid,count=2",
                                  "p-sd:beta=0.3,fields=cos", "ch-sd-screened:beta=0.2,gamma=0.5",
                                  "ch-sd:beta=0.2+p-sd:beta=0.2,fields=cos", "trouve-vialard:sigma=0.01"}) {
    const Motion motion = this->motion(noise);
    const std::vector<Points> paths = motion.flow().paths(q0_);
    ASSERT_EQ(paths.size(), motion.path.states.size());
    for (std::size_t k = 0; k < paths.size(); ++k)
      EXPECT_LE((paths[k] - motion.path.states[k].q).norm(), 1e-10) << noise << ", time " << k;
  }
}

TEST_P(MaterialFlowContract, EndIsTheLastPlace) {
  const MaterialFlow flow = motion("ch-sd:beta=0.5").flow();
  const Points labels = 2 * random_points(d_, 30, 3);
  const std::vector<Points> paths = flow.paths(labels);
  EXPECT_EQ(paths.front(), labels);
  EXPECT_EQ(paths.back(), flow.end(labels));
}

TEST_P(MaterialFlowContract, KeepsOrientationWithoutNoiseAndWithThatOfFields) {
  for (const std::string noise : {"none", "p-sd:beta=0.1,fields=grid,count=2", "trouve-vialard:sigma=0.01"})
    expect_orientation(motion(noise).flow());
}

TEST(MaterialFlow, RefusesIntegratorsThatItDoesNotKnow) {
  const StochasticSystem system{make_kernel("gaussian:alpha=1", {}), make_noise("none")};
  const Motion motion = move("heun", system, {Points::Zero(2, 1), Points::Ones(2, 1)}, {1, 2}, Eigen::MatrixXd(0, 2));
  EXPECT_THROW(motion.flow(), InputError);
}

TEST_P(MaterialFlowContract, IsTheIdentityAtRest) {
  const StochasticSystem system{kernel_, make_noise("none")};
  const Motion motion = move(integrator_, system, {q0_, Points::Zero(d_, 7)}, {1, 20}, Eigen::MatrixXd(0, 20));
  const Points labels = 2 * random_points(d_, 30, 3);
  EXPECT_EQ(motion.flow().end(labels), labels);
}

// With p = 0 and the same noise δ on all landmarks, x moves by Σ_a c_a(x) times δ.
TEST_P(MaterialFlowContract, CommonNoiseMovesPointsByTheSumOfTheCardinalFunctions) {
  const StochasticSystem system{kernel_, make_noise("ch-sd:beta=0.5")};
  const Points common = random_points(d_, 20, 4);
  const Motion motion = move(integrator_, system, {q0_, Points::Zero(d_, 7)}, {1, 20}, common.replicate(7, 1));
  const Points& end = motion.path.final().q;
  const Eigen::VectorXd shift = end.col(0) - q0_.col(0);
  EXPECT_LE(((end - q0_).colwise() - shift).norm(), 1e-13);
  const Points labels = 2 * random_points(d_, 30, 3);
  const Eigen::VectorXd share =
      kernel_.gram(labels, q0_) * kernel_.gram(q0_, q0_).partialPivLu().solve(Eigen::VectorXd::Ones(7));
  EXPECT_LE((motion.flow().end(labels) - (labels + shift * share.transpose())).norm(), 1e-10);
  EXPECT_LE((motion.flow().end(q0_) - end).norm(), 1e-10);
  const Points far = Points::Constant(d_, 1, 1e4);
  EXPECT_EQ(motion.flow().end(far), far);
}

// A step of size κ = Δt Lip(K)|p| < 1 past one landmark is a contraction: every point has its place, in order.
TEST_P(MaterialFlowContract, FindsEveryPlaceWhereStepsContract) {
  const TimeGrid grid{1, 2};
  const StochasticSystem system{kernel_, make_noise("none")};
  const Eigen::RowVectorXd along = Eigen::RowVectorXd::LinSpaced(401, -4, 4);
  for (const double kappa : {0.3, 0.6, 0.95}) {
    Points p0 = Points::Zero(d_, 1);
    p0(0) = kappa / (grid.dt() * kernel_.lipschitz());
    Points labels = Points::Zero(d_, 401);
    labels.row(0) = along;
    const Motion motion = move(integrator_, system, {Points::Zero(d_, 1), p0}, grid, Eigen::MatrixXd(0, 2));
    const Points end = motion.flow().end(labels);
    EXPECT_NEAR(end(0, 200), motion.path.final().q(0), 1e-10) << kappa;
    for (int m = 1; m < 401; ++m) EXPECT_LT(end(0, m - 1), end(0, m)) << kappa << ", " << along[m];
  }
}

// Noise that swaps two landmarks on a line: the points between them are turned over, and those outside stay in order.
TEST(MaterialFlow, TakesPointsBetweenSwappedLandmarksAlong) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.3", Points()), make_noise("ch-sd:beta=1")};
  const Points q0 = (Points(1, 2) << 0, 1).finished();
  const Points increments = (Points(2, 2) << 1, 0, -1, 0).finished();
  const Motion motion = move("variational", system, {q0, Points::Zero(1, 2)}, {1, 2}, increments);
  const Points end = motion.flow().end((Points(1, 6) << -2, 0, 0.45, 0.55, 1, 3).finished());
  EXPECT_NEAR(end(1), 1, 1e-12);
  EXPECT_NEAR(end(4), 0, 1e-12);
  EXPECT_EQ(end(0), -2);
  EXPECT_NEAR(end(5), 3, 1e-12);
}

// Steps of many widths have several roots: the right one or an error, but nothing else.
TEST(MaterialFlow, CarriesLandmarksOverLongStepsOrRefuses) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.1", Points()), make_noise("none")};
  for (const double momentum : {0.5, 2.0, 10.0}) {
    const PhaseState initial{Points::Zero(1, 1), Points::Constant(1, 1, momentum)};
    const Motion motion = move("variational", system, initial, {1, 4}, Eigen::MatrixXd(0, 4));
    try {
      const Points end = motion.flow().end((Points(1, 3) << -0.01, 0, 0.01).finished());
      EXPECT_NEAR(end(1), motion.path.final().q(0), 1e-10) << momentum;
      EXPECT_LT(end(0), end(1)) << momentum;
      EXPECT_LT(end(1), end(2)) << momentum;
    } catch (const StepError&) {
    }
  }
}

// ---- triangles

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
}  // namespace pulson
