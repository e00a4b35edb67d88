// The velocity field of a landmark path: it moves the landmarks, and with the peakon's kernel its momentum density
// u − α²u'' lies on them alone.

#include "pulson/warp/velocity_field.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::warp {
namespace {

Trajectory quiet_path(const std::string& kernel, const PhaseState& start, const TimeGrid& grid) {
  Landmarks shape;
  shape.points = start.q;
  const StochasticSystem system{make_kernel(kernel), make_noise("none", shape)};
  return make_integrator("rk4")->integrate(system, start, grid, Eigen::MatrixXd(0, grid.steps));
}

SpaceGrid only(const Eigen::VectorXd& place) {
  SpaceGrid grid;
  for (const double x : place) grid.emplace_back(Eigen::VectorXd::Constant(1, x));
  return grid;
}

// The derivative of q at step k, to fourth order in the step.
Points rate(const Trajectory& path, int k) {
  const auto q = [&](int at) -> const Points& { return path.states[static_cast<std::size_t>(at)].q; };
  return (8 * (q(k + 1) - q(k - 1)) - (q(k + 2) - q(k - 2))) / (12 * path.grid.dt());
}

TEST(VelocityField, AtLandmarksIsTheirVelocity) {
  for (const int d : {1, 2, 3}) {
    const PhaseState start{2 * random_points(d, 4, 1), random_points(d, 4, 2)};
    const Trajectory path = quiet_path("gaussian:alpha=0.8", start, {1, 100});
    for (const int k : {2, 50, 98}) {
      const Points velocity = rate(path, k);
      for (Eigen::Index a = 0; a < 4; ++a) {
        const Points& q = path.states[static_cast<std::size_t>(k)].q;
        const VelocityField field = velocity_field(make_kernel("gaussian:alpha=0.8"), path, only(q.col(a)), {k});
        EXPECT_LE((field.velocities[0].col(0) - velocity.col(a)).norm(), 1e-7) << d << "D, step " << k;
      }
    }
  }
}

class Peakons : public testing::Test {
 protected:
  static constexpr double kAlpha = 0.6;

  Peakons() {
    start_.q = (Points(1, 3) << -0.9, 0.2, 1.3).finished();
    start_.p = (Points(1, 3) << 1.5, -0.7, 0.4).finished();
    path_ = quiet_path("peakon:alpha=0.6", start_, {0.01, 1});
  }

  Eigen::RowVectorXd u(const Eigen::VectorXd& x) const {
    return velocity_field(make_kernel("peakon:alpha=0.6"), path_, {x}, {0}).velocities[0];
  }

  PhaseState start_;
  Trajectory path_;
};

TEST_F(Peakons, HaveNoMomentumBetweenLandmarks) {
  constexpr double h = 1e-3;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(5001, -2.5, 2.5);
  const Eigen::RowVectorXd values = u(x);
  for (Eigen::Index i = 1; i + 1 < x.size(); ++i) {
    if ((start_.q.array() - x[i]).abs().minCoeff() < 1.5 * h) continue;
    const double second = (values[i - 1] - 2 * values[i] + values[i + 1]) / (h * h);
    EXPECT_LE(std::abs(values[i] - kAlpha * kAlpha * second), 1e-6) << x[i];  // h²/12 u'''' is 6e-7
  }
}

// u − α²u'' = 2α Σ p_a δ(x − q_a): the slope of u falls by 2 p_a/α at q_a.
TEST_F(Peakons, HaveASlopeThatJumpsByTheMomentum) {
  constexpr double h = 1e-4;
  for (Eigen::Index a = 0; a < 3; ++a) {
    const double q = start_.q(0, a);
    const Eigen::RowVectorXd near = u(Eigen::VectorXd::LinSpaced(5, q - 2 * h, q + 2 * h));
    const double left = (3 * near[2] - 4 * near[1] + near[0]) / (2 * h);
    const double right = (-3 * near[2] + 4 * near[3] - near[4]) / (2 * h);
    EXPECT_NEAR(right - left, -2 * start_.p(0, a) / kAlpha, 1e-6);
  }
}

TEST(VelocityField, HasItsNumbersInTheOrderOfTimeComponentAndGrid) {
  const PhaseState start{random_points(2, 3, 3), random_points(2, 3, 4)};
  const Trajectory path = quiet_path("gaussian:alpha=0.5", start, {0.2, 4});
  const SpaceGrid grid{Eigen::Vector3d(-1, 0, 1), Eigen::Vector2d(0.25, 0.5)};
  const VelocityField field = velocity_field(make_kernel("gaussian:alpha=0.5"), path, grid, {0, 4});
  EXPECT_EQ(field.times, (std::vector<double>{0, 0.2}));
  const std::vector<double> numbers = field.numbers();
  ASSERT_EQ(numbers.size(), 2U * 2 * 3 * 2);
  std::size_t at = 0;
  for (const int k : {0, 4})
    for (int axis = 0; axis < 2; ++axis)
      for (const double x : grid[0])
        for (const double y : grid[1]) {
          const PhaseState& state = path.states[static_cast<std::size_t>(k)];
          double sum = 0;
          for (int b = 0; b < 3; ++b)
            sum += state.p(axis, b) * std::exp(-(Eigen::Vector2d(x, y) - state.q.col(b)).squaredNorm() / 0.25);
          EXPECT_NEAR(numbers[at++], sum, 1e-14);
        }
}

TEST(SpaceGrid, HoldsThePathWithAMarginInSquareCells) {
  Trajectory path;
  path.states = {{(Points(2, 2) << 0, 4, 1, 1).finished(), Points::Zero(2, 2)},
                 {(Points(2, 2) << 0, 6, 1, 2).finished(), Points::Zero(2, 2)}};
  const SpaceGrid grid = grid_around(make_kernel("gaussian:alpha=1.5"), path, 37);
  ASSERT_EQ(grid.size(), 2U);
  EXPECT_EQ(grid[0].size(), 37);
  EXPECT_NEAR(grid[0][0], -1.5, 1e-12);
  EXPECT_NEAR(grid[0][36], 7.5, 1e-12);
  const double spacing = grid[0][1] - grid[0][0];
  EXPECT_NEAR(grid[1][1] - grid[1][0], spacing, 1e-12);
  EXPECT_NEAR(grid[1][0], -0.5, spacing);
  EXPECT_NEAR(grid[1][grid[1].size() - 1], 3.5, spacing);
  const auto margin = [&](const std::string& kernel) { return -grid_around(make_kernel(kernel), path, 2)[0][0]; };
  EXPECT_NEAR(margin("gaussian:alpha=100"), 0.5 * 6, 1e-12);
  EXPECT_NEAR(margin("gaussian:alpha=0.01"), 0.12 * 6, 1e-12);
}

}  // namespace
}  // namespace pulson::warp
