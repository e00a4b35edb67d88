#pragma once

// Meshes made by maps of the plane, and what a raster has of them.

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "pulson/core/parallel.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {

inline constexpr float kFloatNaN = std::numeric_limits<float>::quiet_NaN();

using Place = std::array<double, 2>;
using Map = std::function<Place(double, double)>;

inline DeformedMesh mesh_of(int width, int height, const Map& map) {
  DeformedMesh mesh{width + 1, height + 1, {}};
  for (int row = 0; row <= height; ++row)
    for (int column = 0; column <= width; ++column) {
      const Place place = map(column - 0.5, row - 0.5);
      mesh.vertices.push_back({static_cast<float>(place[0]), static_cast<float>(place[1])});
    }
  return mesh;
}

/// Signed: output area over source area.
inline double triangle_jacobian(const std::array<std::array<float, 2>, 3>& places,
                                const std::array<std::array<double, 2>, 3>& labels) {
  const auto doubled_area = [](const auto& t) {
    return (static_cast<double>(t[1][0]) - t[0][0]) * (static_cast<double>(t[2][1]) - t[0][1]) -
           (static_cast<double>(t[1][1]) - t[0][1]) * (static_cast<double>(t[2][0]) - t[0][0]);
  };
  return doubled_area(places) / doubled_area(labels);
}

/// Of a triangle of a cell that is not split.
inline double triangle_jacobian(const DeformedMesh& mesh, int column, int row, std::size_t triangle) {
  std::array<std::array<float, 2>, 3> places{};
  std::array<std::array<double, 2>, 3> labels{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [right, down] = kCellTriangles[triangle][i];
    places[i] = mesh.at(column + right, row + down);
    labels[i] = {static_cast<double>(column + right), static_cast<double>(row + down)};
  }
  return triangle_jacobian(places, labels);
}

/// Of row-by-row arrays.
inline std::size_t index_at(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

inline std::array<float, 2>& vertex(DeformedMesh& mesh, int column, int row) {
  return mesh.vertices[index_at(mesh.columns, column, row)];
}

/// All bands as one, made by parallel_for.
inline RasterBand joined(const MeshRaster& raster, const std::function<RasterBand(int)>& make) {
  std::vector<RasterBand> bands(static_cast<std::size_t>(raster.bands()));
  parallel_for(raster.bands(), [&](int i) { bands[static_cast<std::size_t>(i)] = make(i); });
  RasterBand all = bands.front();
  for (std::size_t i = 1; i < bands.size(); ++i) {
    EXPECT_EQ(bands[i].first_row, all.first_row + all.rows);
    all.rows += bands[i].rows;
    all.labels.insert(all.labels.end(), bands[i].labels.begin(), bands[i].labels.end());
    all.counts.insert(all.counts.end(), bands[i].counts.begin(), bands[i].counts.end());
    all.reversed.insert(all.reversed.end(), bands[i].reversed.begin(), bands[i].reversed.end());
  }
  return all;
}

inline RasterBand whole(const MeshRaster& raster) {
  return joined(raster, [&](int i) { return raster.band(i); });
}

inline RasterBand whole_sheet(const MeshRaster& raster, int n) {
  return joined(raster, [&](int i) { return raster.sheet(i, n); });
}

/// visit(index, x, y) for every sample, at its place in pixel coordinates.
template <class Visit>
void for_each_sample(const RasterBand& band, const Visit& visit) {
  const int s = band.supersampling;
  const auto place = [s](int sample) { return (sample + 0.5) / s - 0.5; };
  std::size_t index = 0;
  for (int row = band.first_row * s; row < (band.first_row + band.rows) * s; ++row)
    for (int column = 0; column < band.width * s; ++column) visit(index++, place(column), place(row));
}

inline void expect_same(const RasterBand& a, const RasterBand& b) {
  EXPECT_EQ(a.counts, b.counts);
  EXPECT_EQ(a.reversed, b.reversed);
  ASSERT_EQ(a.labels.size(), b.labels.size());
  for (std::size_t i = 0; i < a.labels.size(); ++i) {
    if (a.counts[i] == 0 && b.counts[i] == 0) continue;
    ASSERT_EQ(a.labels[i], b.labels[i]) << i;
  }
}

inline int count_at(const RasterBand& band, int x, int y) { return band.counts[index_at(band.width, x, y)]; }

inline std::array<float, 2> label_at(const RasterBand& band, int x, int y) {
  return band.labels[index_at(band.width, x, y)];
}

}  // namespace pulson::warp
