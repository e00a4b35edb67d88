// Cells of a mesh that are split where two triangles contradict the map's own orientation.

#include "warp/split_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "mesh_raster_examples.hpp"

namespace pulson::warp {
namespace {

constexpr int kWidth = 70;
constexpr int kHeight = 60;

// A turn about the middle by an angle that falls with the distance: areas stay, and pixels are sheared by up to
// 0.86 kTurn.
constexpr double kTurn = 12;
constexpr double kReach = 14;
Eigen::Vector2d swirl(const Eigen::Vector2d& x, double direction) {
  const Eigen::Vector2d middle(kWidth / 2.0, kHeight / 2.0), z = x - middle;
  const double angle = direction * kTurn * std::exp(-z.squaredNorm() / (kReach * kReach));
  return middle + Eigen::Rotation2Dd(angle).toRotationMatrix() * z;
}

// R + (R z⊥) ⊗ ∇angle, of determinant 1.
Eigen::Matrix2d swirl_gradient(const Eigen::Vector2d& x) {
  const Eigen::Vector2d z = x - Eigen::Vector2d(kWidth / 2.0, kHeight / 2.0);
  const double angle = kTurn * std::exp(-z.squaredNorm() / (kReach * kReach));
  const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(angle).toRotationMatrix();
  const Eigen::Vector2d turned = rotation * Eigen::Vector2d(-z[1], z[0]);
  return rotation + turned * (-2 * angle / (kReach * kReach) * z).transpose();
}

MovedPoints swirl_map(const Points& x) {
  MovedPoints moved{Points(2, x.cols()), Eigen::MatrixXd(4, x.cols())};
  for (Eigen::Index m = 0; m < x.cols(); ++m) {
    moved.places.col(m) = swirl(x.col(m), 1);
    moved.gradients.col(m) = swirl_gradient(x.col(m)).reshaped();
  }
  return moved;
}

Place swirl_place(double x, double y) {
  const Eigen::Vector2d place = swirl({x, y}, 1);
  return {place[0], place[1]};
}

std::vector<bool> everywhere(bool reversed, const DeformedMesh& mesh) {
  return std::vector<bool>(static_cast<std::size_t>(mesh.cell_columns() * mesh.cell_rows()), reversed);
}

int flipped_triangles_of(const DeformedMesh& mesh) {
  int count = 0;
  for (int row = 0; row < mesh.cell_rows(); ++row) {
    auto split = mesh.split_from(0, row);
    for (int column = 0; column < mesh.cell_columns(); ++column) {
      if (split != mesh.split.end() && split->row == row && split->column == column) {
        for (const MeshTriangle& triangle : split->triangles)
          count += triangle_jacobian(triangle.places, triangle.labels) < 0 ? 1 : 0;
        ++split;
      } else {
        for (const std::size_t triangle : {0U, 1U}) count += triangle_jacobian(mesh, column, row, triangle) < 0 ? 1 : 0;
      }
    }
  }
  return count;
}

DeformedMesh split_swirl() {
  DeformedMesh mesh = mesh_of(kWidth, kHeight, swirl_place);
  split_cells(swirl_map, everywhere(false, mesh), mesh);
  return mesh;
}

TEST(SplitCells, LeaveNoTriangleOfASwirlFlipped) {
  EXPECT_GT(flipped_triangles_of(mesh_of(kWidth, kHeight, swirl_place)), 100);
  EXPECT_EQ(flipped_triangles_of(split_swirl()), 0);
}

// The swirl takes a disc about the middle to itself: inside, each sample has one sheet, whose label is near where the
// inverse goes; of the mesh that is not split some samples have several.
TEST(SplitCells, CoverEverySampleOnceByItsOwnLabel) {
  const RasterOptions options{.width = kWidth, .height = kHeight};
  const auto most = [](const RasterBand& band) { return coverage(band).max_multiplicity; };
  EXPECT_GE(most(whole(MeshRaster(mesh_of(kWidth, kHeight, swirl_place), options))), 3);
  const RasterBand band = whole(MeshRaster(split_swirl(), options));
  EXPECT_EQ(most(band), 1);
  double distances = 0;
  int samples = 0;
  for_each_sample(band, [&](std::size_t i, double x, double y) {
    if (std::hypot(x - kWidth / 2.0, y - kHeight / 2.0) > 28) return;
    ASSERT_EQ(band.counts[i], 1) << x << ", " << y;
    distances += (swirl({x, y}, -1) - Eigen::Vector2d(band.labels[i][0], band.labels[i][1])).norm();
    ++samples;
  });
  EXPECT_LT(distances / samples, 0.2);
}

// Triangles of a cell fill it, and two cells that share a side have the same corners on it.
TEST(SplitCells, FillTheirCellsWithoutGaps) {
  const DeformedMesh mesh = split_swirl();
  ASSERT_FALSE(mesh.split.empty());
  std::map<std::array<double, 4>, int> sides;  // the shortest ones from corner to corner, each way
  for (const SplitCell& cell : mesh.split) {
    double area = 0;
    for (const MeshTriangle& triangle : cell.triangles) {
      const auto& [a, b, c] = triangle.labels;
      area += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
        ++sides[{from[0], from[1], to[0], to[1]}];
    }
    EXPECT_DOUBLE_EQ(area, 1);
  }
  const auto is_whole_side = [](const std::array<double, 4>& side) {
    return std::abs(side[0] - side[2]) + std::abs(side[1] - side[3]) == 1 && (side[0] == side[2] || side[1] == side[3]);
  };
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    const bool has_other = sides.contains({side[2], side[3], side[0], side[1]});
    EXPECT_TRUE(has_other || is_whole_side(side));  // the neighbour of a whole side is a cell of two triangles
  }
}

TEST(SplitCells, AreLimitedInNumber) {
  const auto triangles_with = [](std::size_t most) {
    DeformedMesh mesh = mesh_of(kWidth, kHeight, swirl_place);
    split_cells(swirl_map, everywhere(false, mesh), mesh, most);
    std::size_t count = 0;
    for (const SplitCell& cell : mesh.split) count += cell.triangles.size();
    return count;
  };
  const std::size_t all = triangles_with(kMostSplitTriangles);
  EXPECT_GT(all, 10000);
  EXPECT_LT(triangles_with(all / 2), all);
  EXPECT_EQ(triangles_with(100), 0U);  // more cells than that are in question
}

TEST(SplitCells, AreNoneWhereTheMapIsNearlyLinear) {
  DeformedMesh identity = mesh_of(20, 10, [](double x, double y) { return Place{x, y}; });
  const auto never = [](const Points&) -> MovedPoints { throw std::logic_error("the map is not asked"); };
  split_cells(never, everywhere(false, identity), identity);
  EXPECT_TRUE(identity.split.empty());
  DeformedMesh mirror = mesh_of(20, 10, [](double x, double y) { return Place{19 - x, y}; });
  split_cells(never, everywhere(true, mirror), mirror);
  EXPECT_TRUE(mirror.split.empty());
}

}  // namespace
}  // namespace pulson::warp
