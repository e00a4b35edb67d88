#pragma once

#include <array>
#include <functional>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/warp/material_flow.hpp"

namespace pulson::warp {

/// The Delaunay triangles of points in the plane, as indices, each in positive orientation. Empty where all points lie
/// on a line or there are fewer than three. @param points 2×N
std::vector<std::array<int, 3>> delaunay_triangles(const Points& points);

/// Those of delaunay_triangles() whose orientation is reversed in `after`, of which triangles that miss a coordinate
/// are none. @param after 2×N
std::vector<std::array<int, 3>> flipped_of(const std::vector<std::array<int, 3>>& triangles, const Points& after);

/// How many of the Delaunay triangles of `before` there are. @param before, after 2×N
int flipped_triangles(const Points& before, const Points& after);

/// The nodes of a grid over an image: node (c, r) is at (c + first, r + first) in pixel coordinates.
struct SampledPlane {
  int columns = 0;
  int rows = 0;
  double first = 0;  ///< 0 for the centres of pixels, −0.5 for their corners
};

/// The images of the nodes of a plane under a map, NaN where it has no value.
struct SampledMap {
  int columns = 0;
  int rows = 0;
  std::vector<std::array<float, 2>> places;  ///< row by row, in pixel coordinates
  std::vector<float> jacobians;              ///< determinants of the gradient, if asked for
  double error = 0;           ///< largest distance from the exact map found at check points, in pixels, before rounding
  double jacobian_error = 0;  ///< the same of `jacobians`
  double exact_fraction = 0;  ///< points evaluated exactly over nodes
};

/// Takes the rows of a sampled map one after the other: those of `band` begin at `first_row` of the plane.
using UseRows = std::function<void(int first_row, SampledMap&& band)>;

/// The exact map: images of 2×M points, and their gradients. It is called from one thread at a time, with many points.
using PlaneMap = std::function<MovedPoints(const Points&)>;

/// Places of all nodes, by interpolation between exact ones wherever that is good enough.
///
/// A cell of the plane is known by 3×3 exact places and gradients: in each quarter of it places are the linear blend of
/// the cubics along the four edges (Adini's element, exact for cubics, error O(h⁴)), and determinants are biquadratic
/// in the whole of it. Cells are halved until both agree with the exact map in the middle of every quarter, places to
/// tolerance / 2 and determinants, if asked for, to tolerance / 10 pixels; quarters of one pixel are exact. Between
/// these check points places of all maps of the tests are within the tolerance (a tenth above it near kinks), and
/// determinants within 0.4 tolerance / pixel. What no check point sees is not there: a gaussian bump exp(−r²/α²) is
/// safe where `coarsest` is at most 4 α, so is a border of where there are values up to protrusions that lie between
/// check points.
///
/// Runs on all threads; the result does not depend on their number. Some nanoseconds per node besides `map`; memory for
/// some two million nodes at a time besides the result.
///
/// @param tolerance in pixels
/// @param coarsest largest side of a cell, in nodes
/// @throws InputError for sizes below 1, more than 2^31 nodes, a tolerance that is not finite and positive, a coarsest
/// below 1, a map that returns other sizes; whatever `map` throws
SampledMap sample_map(const PlaneMap& map, const SampledPlane& plane, double tolerance, bool with_jacobians,
                      int coarsest = 64);

/// The same nodes, some rows at a time, of which only those are in memory. `error`, `jacobian_error` and
/// `exact_fraction` are those of the band. @throws as sample_map, and whatever `use` throws
void sample_map_by_rows(const PlaneMap& map, const SampledPlane& plane, double tolerance, bool with_jacobians,
                        const UseRows& use, int coarsest = 64);

}  // namespace pulson::warp
