#pragma once

#include <cstddef>
#include <vector>

#include "pulson/warp/sampled_map.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {

/// Half of these are halvings of a cell's sides. Of swirls that stretch pixels 12 and 40 times, all samples and all but
/// 16 of 16384 then have one sheet; where these do not suffice, each one more doubles the triangles.
inline constexpr int kMostBisections = 8;

/// Some 0.2 GB. How many triangles a map needs depends on it and not on the size of the picture: the swirls above take
/// 40000 and 170000. What takes more mixes the picture more finely than pixels can show.
inline constexpr std::size_t kMostSplitTriangles = std::size_t{1} << 20;

/// Splits the cells of a mesh in which the map turns between the corners, so that a triangle has the opposite
/// orientation of the map at all three of its corners: a strong shear does that without any fold. Triangles are
/// bisected at the middle of their longest side, with the one on its other side, until none is of that kind, or
/// kMostBisections of its cell: so the mesh has no gaps, and that of a map without folds covers nothing twice.
///
/// @param map of places in pixels, as that of the mesh's vertices
/// @param reversed of each cell, row by row, whether the determinant of the map's gradient is negative in its middle
/// @param most with so many triangles no further round of bisections begins
void split_cells(const PlaneMap& map, const std::vector<bool>& reversed, DeformedMesh& mesh,
                 std::size_t most = kMostSplitTriangles);

}  // namespace pulson::warp
