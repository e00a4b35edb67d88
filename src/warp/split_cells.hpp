#pragma once

#include <vector>

#include "pulson/warp/sampled_map.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {

/// Splits the cells of a mesh in which the map turns between the corners, so that a triangle has the opposite
/// orientation of the map at all three of its corners: a strong shear does that without any fold. Triangles are
/// bisected at the middle of their longest side, with the one on its other side, until none is of that kind, or
/// kMostBisections of its cell: so the mesh has no gaps, and that of a map without folds covers nothing twice.
///
/// @param map of places in pixels, as that of the mesh's vertices
/// @param reversed of each vertex, whether the determinant of the map's gradient is negative there
void split_cells(const PlaneMap& map, const std::vector<bool>& reversed, DeformedMesh& mesh);

/// Half of these are halvings of its sides.
inline constexpr int kMostBisections = 8;

}  // namespace pulson::warp
