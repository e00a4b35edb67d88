#pragma once

#include <array>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// How one looks at space: unit vectors, at right angles, to the right and upwards.
using Screen = Eigen::Matrix<double, 2, 3>;

/// A part of the screen, in length units, and how many pixels across it is drawn.
struct Window {
  Eigen::Vector2d low;
  Eigen::Vector2d high;
  int width;
};

/// Vertices 3×V and the triangles between them, as indices from 0, whichever way round.
struct SurfaceParts {
  const Points& vertices;
  const std::vector<std::array<int, 3>>& triangles;
};

inline const Points kNoVertices(3, 0);
inline const std::vector<std::array<int, 3>> kNoTriangles;
inline const SurfaceParts kNoSurface{kNoVertices, kNoTriangles};

/// The surface in pale greys that leave room for marks above it, transparent where there is none: parallel projection,
/// the nearest of overlapping triangles, light from the upper left, normals interpolated between the vertices.
Raster shaded(const SurfaceParts& surface, const Screen& screen, const Window& window);

/// Which of the points, 3×N, lie behind the surface: further from the viewer than it, by more than 2 % of the window's
/// diagonal, as landmarks that lie on the surface may be a little below it.
std::vector<int> points_behind(const SurfaceParts& surface, const Screen& screen, const Window& window,
                               const Points& points);

}  // namespace pulson::draw
