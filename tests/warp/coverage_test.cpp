// Folds of a mesh, holes in what it covers, and sums over bands.

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "mesh_raster_examples.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {
namespace {

TEST(MeshFolds, CountsReversedTriangles) {
  const MeshFolds none = mesh_folds(mesh_of(9, 7, [](double x, double y) { return Place{2 * x, 3 * y}; }));
  EXPECT_EQ(none.folded_fraction, 0);
  EXPECT_EQ(none.triangles, 126);
  EXPECT_EQ(none.min_jacobian, 6);
  EXPECT_EQ(none.max_jacobian, 6);
  DeformedMesh mesh = mesh_of(40, 10, [](double x, double y) { return Place{std::abs(x - 9.5), 2 * y}; });
  const MeshFolds folds = mesh_folds(mesh);
  EXPECT_EQ(folds.folded_fraction, 0.25);
  EXPECT_EQ(folds.reversed_triangles, 200);
  EXPECT_EQ(folds.min_jacobian, -2);
  EXPECT_EQ(folds.max_jacobian, 2);
  EXPECT_EQ(folds.reversed_in_cell[9], 2);
  EXPECT_EQ(folds.reversed_in_cell[10], 0);
  vertex(mesh, 0, 0) = {kFloatNaN, 0};
  EXPECT_EQ(mesh_folds(mesh).triangles, 798);
  EXPECT_EQ(mesh_folds(mesh).reversed_triangles, 198);
}

TEST(MeshFolds, OfNothingHaveNoJacobian) {
  const MeshFolds folds = mesh_folds({2, 2, {{kFloatNaN, 0}, {1, 0}, {0, 1}, {1, 1}}});
  EXPECT_EQ(folds.triangles, 0);
  EXPECT_EQ(folds.folded_fraction, 0);
  EXPECT_TRUE(std::isnan(folds.min_jacobian));
  EXPECT_EQ(folds.reversed_in_cell.size(), 1U);
}

TEST(Enclosed, KeepsWhatDoesNotReachTheBorder) {
  const std::vector<std::string> picture = {"..........",  //
                                            ".####..##.",  //
                                            ".#..#..#..",  //
                                            ".#.##...#.",  //
                                            ".###.#....",  //
                                            "....#.....",  //
                                            ".........."};
  std::vector<bool> mask;
  for (const std::string& row : picture)
    for (const char pixel : row) mask.push_back(pixel == '.');
  const std::vector<bool> holes = enclosed(mask, 10, 7);
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < holes.size(); ++i)
    if (holes[i]) indices.push_back(i);
  EXPECT_EQ(indices, (std::vector<std::size_t>{22, 23, 32, 44}));
  EXPECT_NE(error_of([&] { enclosed(mask, 9, 7); }), "no error");
}

TEST(Coverage, AddsUpOverBands) {
  const MeshRaster raster(mesh_of(30, 30,
                                  [](double x, double y) {
                                    return Place{x + 10, y};
                                  }),
                          {30, 30, 2, SheetOrder::kFirst, 4});
  Coverage sum;
  for (int i = 0; i < raster.bands(); ++i) sum += coverage(raster.band(i));
  EXPECT_EQ(sum.samples, 3600);
  EXPECT_EQ(sum.uncovered, 1200);
  EXPECT_EQ(sum.max_multiplicity, 1);
  EXPECT_EQ(Coverage().uncovered_fraction(), 0);
}

}  // namespace
}  // namespace pulson::warp
