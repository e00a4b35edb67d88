#pragma once

#include <array>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// The Delaunay triangles of points in the plane, as indices, each in positive orientation. Empty where all points lie
/// on a line or there are fewer than three. @param points 2×N
std::vector<std::array<int, 3>> delaunay_triangles(const Points& points);

/// Triangles of the Delaunay triangulation of `before` whose orientation is reversed in `after`. @param before, after
/// 2×N
int flipped_triangles(const Points& before, const Points& after);

}  // namespace pulson
