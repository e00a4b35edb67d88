// In how many sheets the rasterised mesh of a folding map covers a pixel, against a search for all points that go
// there.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/images/image_warp.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::images {
namespace {

constexpr int kColumns = 120, kRows = 90;

// Two discs of eight landmarks that momenta turn and noise swaps.
warp::MaterialFlow swapped_discs() {
  Points q0(2, 16), q1(2, 16);
  for (int a = 0; a < 16; ++a) {
    const double angle = 2 * std::numbers::pi * (a % 8) / 8, side = a < 8 ? -1 : 1;
    const Eigen::Vector2d around = 0.4 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    q0.col(a) = around + Eigen::Vector2d(side, 0.1 * side);
    q1.col(a) = around + Eigen::Vector2d(-side, 0.3 * side);
  }
  const StochasticSystem system{make_kernel("gaussian:alpha=0.4", Points()), make_noise("ch-sd:beta=1")};
  const TimeGrid grid{1, 5};
  Eigen::MatrixXd increments = ((q1 - q0).reshaped() / 4).replicate(1, 5);
  increments.rightCols(1).setZero();
  const Points p0 = 0.15 * random_points(2, 16, 8);
  return {system, make_integrator("variational")->integrate(system, {q0, p0}, grid, increments)};
}

struct Preimages {
  std::vector<Eigen::Vector2d> places;
  double least_jacobian = 1e300;  // size of
};

class Multiplicity : public testing::Test {
 protected:
  Multiplicity() {
    const Points corners = grid(kColumns + 1, kRows + 1, -0.5);
    warp::DeformedMesh mesh{kColumns + 1, kRows + 1, {}};
    const Eigen::MatrixXf places = warp_.forward(corners).places.cast<float>();
    for (const auto& place : places.colwise()) mesh.vertices.push_back({place.x(), place.y()});
    const warp::MeshRaster raster(std::move(mesh), {.width = kColumns, .height = kRows, .supersampling = 1});
    for (int i = 0; i < raster.bands(); ++i)
      for (const std::uint8_t count : raster.band(i).counts) counts_.push_back(count);
    starts_ = grid(2 * kColumns + 1, 2 * kRows + 1, -0.5, 0.5);
    from_starts_ = warp_.forward(starts_);
  }

  static Points grid(int columns, int rows, double first, double step = 1) {
    Points points(2, static_cast<Eigen::Index>(columns) * rows);
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      points.col(i) << first + step * static_cast<double>(i % columns),
          first + step * std::floor(static_cast<double>(i) / columns);
    return points;
  }

  int count_at(int x, int y) const {
    return counts_[static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x)];
  }

  // All x with φ(x) = y, by Newton's method from every start that may be near one.
  Preimages preimages(const Eigen::Vector2d& y) const {
    std::vector<Eigen::Index> near;
    for (Eigen::Index m = 0; m < starts_.cols(); ++m) {
      const double stretch = from_starts_.gradients.col(m).norm();
      if ((from_starts_.places.col(m) - y).norm() <= 2 * stretch + 0.5) near.push_back(m);
    }
    Points x = starts_(Eigen::all, near);
    for (int turn = 0; turn < 30 && x.cols() > 0; ++turn) {
      const warp::MovedPoints at = warp_.forward(x);
      for (Eigen::Index m = 0; m < x.cols(); ++m) {
        const Eigen::Matrix2d gradient = at.gradients.col(m).reshaped(2, 2);
        Eigen::Vector2d step = gradient.fullPivLu().solve(y - at.places.col(m));
        if (step.norm() > 1) step.normalize();
        x.col(m) += step;
      }
    }
    const warp::MovedPoints at = warp_.forward(x);
    Preimages found;
    for (Eigen::Index m = 0; m < x.cols(); ++m) {
      if (!((at.places.col(m) - y).norm() <= 1e-8)) continue;
      bool is_new = true;
      for (const Eigen::Vector2d& known : found.places) is_new = is_new && (known - x.col(m)).norm() > 1e-5;
      if (!is_new) continue;
      found.places.emplace_back(x.col(m));
      found.least_jacobian = std::min(found.least_jacobian, std::abs(at.jacobians()[m]));
    }
    return found;
  }

  const warp::MaterialFlow flow_ = swapped_discs();
  const Frame frame_{{-2.4, -1.8}, {0.04, 0.04}};
  const ImageWarp warp_{
      flow_, {AlignmentKind::kNone, 1, Eigen::Matrix2d::Identity(), Eigen::Vector2d::Zero()}, frame_, frame_};
  std::vector<int> counts_;
  Points starts_;
  warp::MovedPoints from_starts_;
};

// Preimages that lie within a pixel of the mesh's border may be on either side of it.
bool is_at_border(const Preimages& all) {
  for (const Eigen::Vector2d& x : all.places)
    if (std::abs(x.x() + 0.5) < 1 || std::abs(x.y() + 0.5) < 1 || std::abs(x.x() - kColumns + 0.5) < 1 ||
        std::abs(x.y() - kRows + 0.5) < 1)
      return true;
  return false;
}

int inside(const Preimages& all) {
  int count = 0;
  for (const Eigen::Vector2d& x : all.places)
    if (x.x() > -0.5 && x.y() > -0.5 && x.x() < kColumns - 0.5 && x.y() < kRows - 0.5) ++count;
  return count;
}

TEST_F(Multiplicity, IsTheNumberOfPreimagesAwayFromFolds) {
  ASSERT_GT(*std::max_element(counts_.begin(), counts_.end()), 2);
  std::array<int, 16> compared{};
  const Points random = random_points(2, 400, 12);
  for (Eigen::Index i = 0; i < random.cols(); ++i) {
    const int x = static_cast<int>(kColumns * (random(0, i) + 1) / 2),
              y = static_cast<int>(kRows * (random(1, i) + 1) / 2);
    if (x < 1 || y < 1 || x > kColumns - 2 || y > kRows - 2) continue;
    const int count = count_at(x, y);
    bool is_even = true;  // no fold or border of the mesh passes here
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) is_even = is_even && count_at(x + dx, y + dy) == count;
    if (!is_even || compared[static_cast<std::size_t>(count)] >= 25) continue;
    const Preimages all = preimages({x, y});
    if (all.least_jacobian < 0.05 || is_at_border(all)) continue;
    EXPECT_EQ(count, inside(all)) << x << ", " << y;
    ++compared[static_cast<std::size_t>(count)];
  }
  EXPECT_GE(compared[1], 20);
  EXPECT_GE(compared[3], 10);
  EXPECT_GE(compared[1] + compared[2] + compared[3] + compared[4] + compared[5], 30);
}

}  // namespace
}  // namespace pulson::images
