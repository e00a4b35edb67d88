#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pulson {

/// The corners of an image's pixels and their images under a map. Positions are in pixel coordinates: x to the right, y
/// down, pixel centres at integers.
struct DeformedMesh {
  int columns = 0;  ///< of vertices: the width of the image + 1
  int rows = 0;     ///< of vertices: its height + 1
  /// Where vertex (c, r), whose label is its position (c − 0.5, r − 0.5) in the source, is mapped; row by row. Cells
  /// with a vertex that is not finite are left out.
  std::vector<std::array<float, 2>> vertices;

  const std::array<float, 2>& at(int column, int row) const {
    return vertices[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(column)];
  }
  int cell_columns() const { return columns - 1; }
  int cell_rows() const { return rows - 1; }

  /// @throws InputError if there is no cell or the number of vertices is not columns · rows
  void check() const;
};

/// The vertices (column, row) of the two triangles of the cell (0, 0). The diagonal goes from the upper right to the
/// lower left corner in every cell. Both triangles keep their orientation under the identity.
inline constexpr std::array<std::array<std::array<int, 2>, 3>, 2> kCellTriangles = {
    {{{{0, 0}, {1, 0}, {0, 1}}}, {{{1, 1}, {0, 1}, {1, 0}}}}};

/// Signed Jacobian, output area over source area, of a triangle (0 or 1) of a cell; NaN where a vertex is not finite.
double triangle_jacobian(const DeformedMesh& mesh, int column, int row, std::size_t triangle);

/// Where a mesh is flipped.
struct MeshFolds {
  double folded_fraction = 0;  ///< of the area of the source that is not left out
  std::int64_t reversed_triangles = 0;
  std::int64_t triangles = 0;  ///< not left out
  double min_jacobian = 0;     ///< NaN where all cells are left out
  double max_jacobian = 0;
  std::vector<std::uint8_t> reversed_in_cell;  ///< reversed triangles of every cell, 0 to 2, row by row
};

/// @throws InputError as DeformedMesh::check
MeshFolds mesh_folds(const DeformedMesh& mesh);

}  // namespace pulson
