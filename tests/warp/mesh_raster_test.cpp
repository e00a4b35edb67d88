// The push-forward of a pixel mesh: what covers each sample, and how often.

#include "warp/mesh_raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "mesh_raster_examples.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::warp {
namespace {

// ---- maps with one sheet

class Supersampling : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(OneToEight, Supersampling, testing::Values(1, 2, 3, 5, 8));

// Where the inverse is inside of the source by more than a pixel: one sheet, with that label.
void expect_one_sheet(const RasterBand& band, int size, bool reversed, const Map& inverse) {
  int inside = 0;
  for_each_sample(band, [&](std::size_t i, double x, double y) {
    const Place label = inverse(x, y);
    const double margin = std::min({label[0], label[1], size - 1 - label[0], size - 1 - label[1]});
    if (margin < 0.01) {
      ASSERT_TRUE(margin > -1 || band.counts[i] == 0) << x << ", " << y;
      return;
    }
    ++inside;
    ASSERT_EQ(band.counts[i], 1) << x << ", " << y;
    ASSERT_EQ(band.reversed[i], reversed ? 1 : 0);
    ASSERT_NEAR(band.labels[i][0], label[0], 2e-3);
    ASSERT_NEAR(band.labels[i][1], label[1], 2e-3);
  });
  EXPECT_GT(inside, 100);
}

TEST_P(Supersampling, IdentityLabelsEverySampleByItsPlace) {
  const MeshRaster raster(mesh_of(70, 23, [](double x, double y) { return Place{x, y}; }), {70, 23, GetParam()});
  const RasterBand band = whole(raster);
  for_each_sample(band, [&](std::size_t i, double x, double y) {
    ASSERT_EQ(band.counts[i], 1);
    ASSERT_EQ(band.reversed[i], 0);
    ASSERT_NEAR(band.labels[i][0], x, 1e-5);
    ASSERT_NEAR(band.labels[i][1], y, 1e-5);
  });
}

TEST_P(Supersampling, RigidMapsHaveOneSheet) {
  constexpr int kSize = 40;
  for (const double degrees : {0.0, 30.0, 45.0, 90.0, 180.0, 217.0})
    for (const double shift : {0.0, 0.5, 3.3, -7.81}) {
      const double c = std::cos(degrees * std::numbers::pi / 180);
      const double s = std::sin(degrees * std::numbers::pi / 180);
      const double m = 19.5;
      const MeshRaster raster(
          mesh_of(kSize, kSize,
                  [&](double x, double y) {
                    return Place{m + c * (x - m) - s * (y - m) + shift, m + s * (x - m) + c * (y - m) - shift};
                  }),
          {kSize, kSize, GetParam()});
      SCOPED_TRACE(std::to_string(degrees) + " degrees, shift " + std::to_string(shift));
      expect_one_sheet(whole(raster), kSize, false, [&](double x, double y) {
        const double u = x - shift - m;
        const double v = y + shift - m;
        return Place{m + c * u + s * v, m - s * u + c * v};
      });
    }
}

TEST_P(Supersampling, MirrorIsReversed) {
  const MeshRaster raster(mesh_of(40, 40, [](double x, double y) { return Place{39 - x, y}; }), {40, 40, GetParam()});
  const RasterBand band = whole(raster);
  EXPECT_EQ(coverage(band).uncovered, 0);
  EXPECT_EQ(coverage(band).max_multiplicity, 1);
  expect_one_sheet(band, 40, true, [](double x, double y) { return Place{39 - x, y}; });
}

// ---- maps that fold

// Solutions of x + a sin(x/b) = value by counting changes of sign on a fine grid.
int roots(double a, double b, double value, double first, double last) {
  constexpr int kIntervals = 4000;
  int count = 0;
  for (int i = 0; i < kIntervals; ++i) {
    const auto f = [&](int k) {
      const double x = first + (last - first) * k / kIntervals;
      return x + a * std::sin(x / b) - value;
    };
    count += (f(i) < 0) != (f(i + 1) < 0) ? 1 : 0;
  }
  return count;
}

TEST(MeshRaster, MultiplicityIsTheNumberOfPreimagesOfASineMap) {
  constexpr int kWidth = 120;
  constexpr double kA = 16;
  constexpr double kB = 7;
  const MeshRaster raster(mesh_of(kWidth, 10,
                                  [](double x, double y) {
                                    return Place{x + kA * std::sin(x / kB), y};
                                  }),
                          {kWidth, 10, 3});
  const RasterBand band = whole(raster);
  std::vector<int> seen(10, 0);
  for_each_sample(band, [&](std::size_t i, double x, double y) {
    if (y > 0) return;
    const auto at = [&](double value) { return roots(kA, kB, value, -0.5, kWidth - 0.5); };
    const int expected = at(x);
    if (at(x - 0.3) != expected || at(x + 0.3) != expected) return;  // chords are that near to a fold's line
    ++seen[static_cast<std::size_t>(expected)];
    EXPECT_EQ(band.counts[i], expected) << x;
  });
  EXPECT_GT(seen[1], 10);
  EXPECT_GT(seen[3], 100);
}

// |x − 20| + 0.25: both sheets on the right of the fold, nothing on its left; without supersampling, the fold's image
// is half-way between samples, then on them.
TEST(MeshRaster, FoldIsCoveredTwiceOrNotAtAll) {
  for (const double fold : {0.25, 0.0, 0.5, 1.0})
    for (const int s : {1, 2, 3, 4}) {
      const MeshRaster raster(mesh_of(40, 40,
                                      [&](double x, double y) {
                                        return Place{std::abs(x - 19.5) + fold, y};
                                      }),
                              {15, 40, s});
      const RasterBand band = whole(raster);
      for_each_sample(band, [&](std::size_t i, double x, double) {
        ASSERT_EQ(band.counts[i], x < fold ? 0 : 2) << x << ", fold at " << fold;
        if (x < fold) return;
        ASSERT_EQ(band.reversed[i], 0);
        ASSERT_GE(band.labels[i][0], 19.5);
      });
    }
}

// ---- against a definition

struct Snapped {
  std::int64_t x, y;
};

Snapped snap(const std::array<float, 2>& place, int s) {
  const auto axis = [s](float value) {
    return static_cast<std::int64_t>(std::floor(((static_cast<double>(value) + 0.5) * s - 0.5) * 1024 + 0.5));
  };
  return {axis(place[0]), axis(place[1])};
}

// Whether a horizontal ray to the right crosses the edge, for a sample moved by (ε, ε²).
bool crosses(const Snapped& a, const Snapped& b, const Snapped& p) {
  if ((a.y > p.y) == (b.y > p.y)) return false;
  const std::int64_t side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  return b.y > a.y ? side > 0 : side < 0;
}

struct Counts {
  int triangles = 0;
  int degree = 0;
};

Counts brute_counts(const DeformedMesh& mesh, int s, const Snapped& p) {
  Counts counts;
  for (int row = 0; row < mesh.cell_rows(); ++row)
    for (int column = 0; column < mesh.cell_columns(); ++column) {
      const Snapped v00 = snap(mesh.at(column, row), s);
      const Snapped v10 = snap(mesh.at(column + 1, row), s);
      const Snapped v01 = snap(mesh.at(column, row + 1), s);
      const Snapped v11 = snap(mesh.at(column + 1, row + 1), s);
      for (const auto& [a, b, c] : {std::array{v00, v10, v01}, std::array{v11, v01, v10}}) {
        if ((crosses(a, b, p) ? 1 : 0) + (crosses(b, c, p) ? 1 : 0) + (crosses(c, a, p) ? 1 : 0) != 1) continue;
        ++counts.triangles;
        counts.degree += (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0 ? 1 : -1;
      }
    }
  return counts;
}

// Vertices at random places, of which some are on samples, and some triangles are flat.
DeformedMesh random_mesh(int seed, int size, double spread, bool on_samples) {
  std::mt19937 bits(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> uniform(-spread, spread);
  return mesh_of(size, size, [&](double x, double y) {
    const Place place = {x + uniform(bits), y + uniform(bits)};
    return on_samples ? Place{std::round(place[0]), std::round(place[1])} : place;
  });
}

TEST(MeshRaster, CountsAsTheDefinitionDoes) {
  for (int seed = 0; seed < 12; ++seed)
    for (const int s : {1, 2, 3}) {
      const double spread = std::array{0.3, 2.0, 30.0}[static_cast<std::size_t>(seed % 3)];
      const DeformedMesh mesh = random_mesh(seed, 8, spread, seed % 2 == 0);
      const MeshRaster raster(mesh, {14, 9, s, SheetOrder::kLeastStretched, 4});
      const RasterBand band = whole(raster);
      std::vector<int> degree(band.counts.size(), 0);
      for (int n = 0; n < coverage(band).max_multiplicity; ++n) {
        const RasterBand sheet = whole_sheet(raster, n);
        for (std::size_t i = 0; i < degree.size(); ++i)
          if (n < sheet.counts[i]) degree[i] += sheet.reversed[i] != 0 ? -1 : 1;
      }
      for_each_sample(band, [&](std::size_t i, double x, double y) {
        const Counts expected = brute_counts(mesh, s, snap({static_cast<float>(x), static_cast<float>(y)}, s));
        ASSERT_EQ(band.counts[i], expected.triangles) << seed << ": " << x << ", " << y;
        ASSERT_EQ(degree[i], expected.degree) << seed << ": " << x << ", " << y;
      });
    }
}

// The label is in the triangle, and the affine map of that triangle takes it to the sample.
TEST(MeshRaster, LabelsAreMappedToTheirSample) {
  const DeformedMesh mesh = random_mesh(3, 12, 3.0, false);
  const MeshRaster raster(mesh, {12, 12, 4});
  const RasterBand band = whole(raster);
  int covered = 0;
  for_each_sample(band, [&](std::size_t i, double x, double y) {
    if (band.counts[i] == 0) return;
    ++covered;
    const double u = band.labels[i][0] + 0.5;
    const double v = band.labels[i][1] + 0.5;
    const int column = std::clamp(static_cast<int>(u), 0, 11);
    const int row = std::clamp(static_cast<int>(v), 0, 11);
    const double a = u - column;
    const double b = v - row;
    const bool upper = a + b <= 1;
    const auto& corner = upper ? mesh.at(column, row) : mesh.at(column + 1, row + 1);
    const auto& along_x = upper ? mesh.at(column + 1, row) : mesh.at(column, row + 1);
    const auto& along_y = upper ? mesh.at(column, row + 1) : mesh.at(column + 1, row);
    const auto image = [&](std::size_t k) {
      const double w1 = upper ? a : 1 - a;
      const double w2 = upper ? b : 1 - b;
      return corner[k] + w1 * (along_x[k] - corner[k]) + w2 * (along_y[k] - corner[k]);
    };
    EXPECT_NEAR(image(0), x, 1e-3);
    EXPECT_NEAR(image(1), y, 1e-3);
  });
  EXPECT_GT(covered, 1000);
}

// Samples times their share of a pixel are a mesh's area, with signs, for a mesh inside of the output.
TEST(MeshRaster, SignedCountsAddUpToTheArea) {
  const Map map = [](double x, double y) {
    return Place{30 + x + 9 * std::sin(0.3 * y + 0.2 * x), 30 + y + 7 * std::sin(0.25 * x)};
  };
  const DeformedMesh mesh = mesh_of(60, 60, map);
  double area = 0;
  for (int row = 0; row < 60; ++row)
    for (int column = 0; column < 60; ++column)
      area += 0.5 * (triangle_jacobian(mesh, column, row, 0) + triangle_jacobian(mesh, column, row, 1));
  const MeshRaster raster(mesh, {120, 120, 4, SheetOrder::kAverage});
  double sum = 0;
  const int sheets = coverage(whole(raster)).max_multiplicity;
  EXPECT_GT(sheets, 2);
  for (int n = 0; n < sheets; ++n) {
    const RasterBand sheet = whole_sheet(raster, n);
    for (std::size_t i = 0; i < sheet.counts.size(); ++i)
      if (n < sheet.counts[i]) sum += (sheet.reversed[i] != 0 ? -1.0 : 1.0) / 16;
  }
  EXPECT_NEAR(sum, area, 2e-3 * area);
}

// ---- bands, threads, extremes

TEST(MeshRaster, DoesNotDependOnBandsOrThreads) {
  const DeformedMesh mesh = random_mesh(5, 100, 6, false);
  const RasterBand expected = whole(MeshRaster(mesh, {100, 100, 2, SheetOrder::kLeastStretched, 100}));
  for (const int rows : {0, 1, 7, 33, 1000})
    for (const int threads : {1, 2, 5}) {
      set_thread_count(threads);
      expect_same(whole(MeshRaster(mesh, {100, 100, 2, SheetOrder::kLeastStretched, rows})), expected);
    }
  set_thread_count(0);
}

// One huge cell against the same in small cells: long rows are found by division, short ones by steps.
TEST(MeshRaster, HugeTrianglesAreAsManySmallOnes) {
  const Map corner = [](double x, double y) { return Place{3.3 * x + 1.1 * y, 0.4 * x + 2.7 * y}; };
  DeformedMesh huge{2, 2, {}};
  for (const double y : {-0.5, 99.5})
    for (const double x : {-0.5, 99.5}) {
      const Place place = corner(x, y);
      huge.vertices.push_back({static_cast<float>(place[0]), static_cast<float>(place[1])});
    }
  const RasterBand one = whole(MeshRaster(huge, {200, 150, 2}));
  const RasterBand many = whole(MeshRaster(mesh_of(100, 100, corner), {200, 150, 2}));
  std::size_t different = 0;
  for (std::size_t i = 0; i < one.counts.size(); ++i) {
    different += one.counts[i] != many.counts[i] ? 1 : 0;
    if (one.counts[i] == 0 || many.counts[i] == 0) continue;
    ASSERT_NEAR((one.labels[i][0] + 0.5) * 100, many.labels[i][0] + 0.5, 5e-3);
    ASSERT_NEAR((one.labels[i][1] + 0.5) * 100, many.labels[i][1] + 0.5, 5e-3);
  }
  EXPECT_LE(different, 5U);  // at the border, where vertices are snapped
  EXPECT_EQ(coverage(many).max_multiplicity, 1);
}

TEST(MeshRaster, LeavesOutCellsWithoutAPlace) {
  const float infinity = std::numeric_limits<float>::infinity();
  for (const std::array<float, 2> nowhere : {std::array{kFloatNaN, 5.0F}, std::array{5.0F, kFloatNaN},
                                             std::array{infinity, 5.0F}, std::array{5.0F, -1e30F}}) {
    DeformedMesh mesh = mesh_of(20, 20, [](double x, double y) { return Place{x, y}; });
    vertex(mesh, 7, 9) = nowhere;
    const RasterBand band = whole(MeshRaster(mesh, {20, 20, 1}));
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 20; ++x) {
        const bool hole = (x == 6 || x == 7) && (y == 8 || y == 9);
        EXPECT_EQ(count_at(band, x, y), hole ? 0 : 1);
        EXPECT_EQ(std::isnan(label_at(band, x, y)[0]), hole);
      }
    EXPECT_EQ(coverage(band).uncovered_fraction(), 4.0 / 400);
    const std::vector<bool> holes = enclosed(uncovered_pixels(band), 20, 20);
    EXPECT_EQ(std::count(holes.begin(), holes.end(), true), 4);
  }
}

TEST(MeshRaster, TrianglesUpToTheLimitAreExact) {
  const float far = 524287;
  const DeformedMesh mesh{2, 2, {{-far, -far}, {far, -far}, {-far, far}, {far, far}}};
  const RasterBand band = whole(MeshRaster(mesh, {50, 40, 1}));
  EXPECT_EQ(coverage(band).uncovered, 0);
  EXPECT_EQ(coverage(band).max_multiplicity, 1);
  DeformedMesh beyond = mesh;
  beyond.vertices[0][0] = -far - 2;
  EXPECT_EQ(coverage(whole(MeshRaster(beyond, {50, 40, 1}))).uncovered, 2000);
}

TEST(MeshRaster, RefusesWhatHasNoMeaning) {
  const DeformedMesh mesh = mesh_of(4, 3, [](double x, double y) { return Place{x, y}; });
  const auto error = [](const DeformedMesh& m, const RasterOptions& options, const std::vector<float>& priority = {}) {
    return error_of([&] { const MeshRaster raster(m, options, priority); });
  };
  EXPECT_EQ(error(mesh, {0, 3}), "output of 0 x 3 pixels: sizes must be positive");
  EXPECT_EQ(error(mesh, {4, -1}), "output of 4 x -1 pixels: sizes must be positive");
  EXPECT_EQ(error(mesh, {4, 3, 0}), "supersampling 0 is not between 1 and 8");
  EXPECT_EQ(error(mesh, {4, 3, 9}), "supersampling 9 is not between 1 and 8");
  EXPECT_EQ(error(mesh, {40000, 3, 8}), "output of 40000 x 3 pixels: with supersampling 8 at most 32768 a side");
  EXPECT_EQ(error({1, 4, {}}, {4, 3}), "mesh of 1 x 4 vertices: at least 2 x 2 are needed");
  EXPECT_EQ(error({2, 3, {{0, 0}}}, {4, 3}), "mesh of 2 x 3 vertices has 1 of them");
  EXPECT_EQ(error(mesh, {4, 3, 2, SheetOrder::kPriority}, {1, 2}), "2 priorities of cells: label-order takes 12");
  EXPECT_EQ(error(mesh, {4, 3, 2, SheetOrder::kFirst}, {1}), "1 priorities of cells: first takes 0");
  EXPECT_EQ(error(mesh, {4, 3, 2, SheetOrder::kPriority}, std::vector<float>(12, kFloatNaN)),
            "priorities of cells must be numbers");
  const MeshRaster raster(mesh, {4, 3});
  EXPECT_EQ(error_of([&] { raster.sheet(0, 255); }), "sheet 255 is not between 0 and 254");
  EXPECT_EQ(error_of([&] { raster.band(1); }), "band 1 is not between 0 and 0");
}

}  // namespace
}  // namespace pulson::warp
