// What a mesh covers: holes, and sums over bands.

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
