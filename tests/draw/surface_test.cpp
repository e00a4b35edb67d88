// A surface in pixels, against what is known of a sphere and of two triangles.
#include "draw/surface.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace pulson::draw {
namespace {

const Screen kFront = (Screen() << 1, 0, 0, 0, 1, 0).finished();  // x to the right, y upwards

struct Sphere {
  Points vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Of radius 1.
Sphere sphere() {
  constexpr int kRings = 90, kAround = 180;
  Sphere sphere{Points(3, kRings * kAround), {}};
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kAround; ++j) {
      const double polar = std::numbers::pi * (i + 0.5) / kRings, angle = 2 * std::numbers::pi * j / kAround;
      sphere.vertices.col(i * kAround + j) << std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
          std::cos(polar);
      if (i == 0) continue;
      const int a = (i - 1) * kAround + j, b = (i - 1) * kAround + (j + 1) % kAround;
      const int c = i * kAround + (j + 1) % kAround, d = i * kAround + j;
      sphere.triangles.push_back({a, b, c});
      sphere.triangles.push_back({a, d, c});  // the other way round
    }
  return sphere;
}

std::uint8_t at(const Raster& raster, int column, int row, int channel) {
  return raster.rgba.at(4 * (static_cast<std::size_t>(row) * raster.width + column) + channel);
}

TEST(Shading, OfASphereCoversItsDiscAndIsLitFromTheUpperLeft) {
  const Sphere ball = sphere();
  const Raster raster = shaded({ball.vertices, ball.triangles}, kFront, {{-1.5, -1}, {1.5, 1}, 300});
  ASSERT_EQ(raster.width, 300);
  ASSERT_EQ(raster.height, 200);
  int covered = 0, brightest = 0;
  Eigen::Vector2d place;
  for (int row = 0; row < raster.height; ++row)
    for (int column = 0; column < raster.width; ++column) {
      covered += at(raster, column, row, 3) == 255;
      if (at(raster, column, row, 3) == 0 || at(raster, column, row, 1) <= brightest) continue;
      brightest = at(raster, column, row, 1);
      place << (column + 0.5) / 100 - 1.5, 1 - (row + 0.5) / 100;
    }
  // The disc has 100² π pixels; the chords of the polygons lie at most 1 − cos(π/90) within, a strip of 19 pixels, and
  // the circumference of 628 pixels is known to half a pixel or so.
  EXPECT_NEAR(covered, 1e4 * std::numbers::pi, 120);
  const Eigen::Vector3d light = Eigen::Vector3d(-0.4, 0.55, 0.75).normalized();
  EXPECT_NEAR(place.x(), light.x(), 0.15);  // where the grey is flat to a level of 255: |angle| < √(2/105)
  EXPECT_NEAR(place.y(), light.y(), 0.15);
}

TEST(Shading, ShowsTheNearerOfTwoTriangles) {
  // The one at z = 1 faces the viewer; the one behind it is steep, and so darker. Both orders.
  const Points vertices = (Points(3, 6) << -1, 1, 0, -1, 1, 0, -1, -1, 1, -1, -1, 1, 1, 1, 1, -9, -9, 0).finished();
  const std::vector<std::array<int, 3>> near_first = {{0, 1, 2}, {3, 4, 5}}, far_first = {{3, 4, 5}, {0, 1, 2}},
                                        alone = {{0, 1, 2}};
  const Window window{{-1, -1}, {1, 1}, 40};
  const Raster expected = shaded({vertices, alone}, kFront, window);
  EXPECT_EQ(shaded({vertices, near_first}, kFront, window).rgba, expected.rgba);
  EXPECT_EQ(shaded({vertices, far_first}, kFront, window).rgba, expected.rgba);
}

// Of a unit sphere, from the front: what lies behind its front half, but by no more than 2 % of the diagonal.
TEST(Shading, KnowsWhichPointsLieBehindTheSurface) {
  const Sphere ball = sphere();
  Points points(3, 6);
  points << 0.2, 0.2, 0.2, 0.5, 1.3, 0.2,  //
      0, 0, 0, 0.5, 0, 0,                  //
      1.1, -1, 0, -0.6, 0, 0.95;           // before, behind, within, behind, beside, just below √(1 − 0.04)
  const std::vector<int> behind =
      points_behind({ball.vertices, ball.triangles}, kFront, {{-1.5, -1.5}, {1.5, 1.5}, 300}, points);
  EXPECT_EQ(behind, (std::vector<int>{1, 2, 3}));
}

TEST(Shading, OfWhatLiesOutsideIsEmpty) {
  const Points vertices = (Points(3, 3) << 10, 11, 10, 10, 10, 11, 0, 0, 0).finished();
  const std::vector<std::array<int, 3>> triangles = {{0, 1, 2}};
  for (const std::uint8_t byte : shaded({vertices, triangles}, kFront, {{-1, -1}, {1, 1}, 10}).rgba) EXPECT_EQ(byte, 0);
}

}  // namespace
}  // namespace pulson::draw
