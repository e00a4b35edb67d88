#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "pulson/warp/sheet_order.hpp"

namespace pulson::warp {

/// A triangle in the source, right-angled at its first corner with sides of equal length, and where its corners are
/// mapped: in pixel coordinates.
struct MeshTriangle {
  std::array<std::array<double, 2>, 3> labels;
  std::array<std::array<float, 2>, 3> places;
};

/// The triangles of a cell that two do not describe well enough, see split_cells().
struct SplitCell {
  int column = 0;
  int row = 0;
  std::vector<MeshTriangle> triangles;
};

/// The corners of an image's pixels and their images under a map. Positions are in pixel coordinates: x to the right, y
/// down, pixel centres at integers.
struct DeformedMesh {
  int columns = 0;  ///< of vertices: the width of the image + 1
  int rows = 0;     ///< of vertices: its height + 1
  /// Where vertex (c, r), whose label is its position (c − 0.5, r − 0.5) in the source, is mapped; row by row. Cells
  /// with a vertex that is not finite are left out.
  std::vector<std::array<float, 2>> vertices;
  std::vector<SplitCell> split = {};  ///< those of these cells replace the two of others; row by row

  const std::array<float, 2>& at(int column, int row) const {
    return vertices[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(column)];
  }
  int cell_columns() const { return columns - 1; }
  int cell_rows() const { return rows - 1; }

  /// The split cells of a row from a column on.
  std::vector<SplitCell>::const_iterator split_from(int column, int row) const;

  /// @throws InputError if there is no cell or the number of vertices is not columns · rows
  void check() const;
};

/// The vertices (column, row) of the two triangles of the cell (0, 0). The diagonal goes from the upper right to the
/// lower left corner in every cell. Both triangles keep their orientation under the identity.
inline constexpr std::array<std::array<std::array<int, 2>, 3>, 2> kCellTriangles = {
    {{{{0, 0}, {1, 0}, {0, 1}}}, {{{1, 1}, {0, 1}, {1, 0}}}}};

struct RasterOptions {
  int width = 0;  ///< of the output, in pixels
  int height = 0;
  int supersampling = 2;  ///< S, 1 to 8: S×S samples per pixel at offsets (i + 0.5)/S − 0.5
  SheetOrder over = SheetOrder::kLeastStretched;
  int rows_per_band = 0;  ///< pixel rows of a band; 0 for bands of about 2^18 samples
};

/// The samples of some pixel rows of the output. Arrays have one entry per sample: width·S in a row, rows·S rows, so
/// the sample (i, j) of pixel (x, first_row + y) is at (y·S + j)·width·S + x·S + i.
struct RasterBand {
  int first_row = 0;
  int rows = 0;
  int width = 0;
  int supersampling = 1;
  std::vector<std::array<float, 2>> labels;  ///< place in the source, in pixel coordinates; NaN where there is none
  std::vector<std::uint8_t> counts;          ///< triangles that cover the sample: its preimages; 255 stands for more
  std::vector<std::uint8_t> reversed;        ///< 1 where the sheet of `labels` is flipped, else 0
};

/// The push-forward of an image's pixel mesh through a map that may fold: for every sample of the output, in how many
/// sheets it is covered and the source position of the top sheet.
///
/// Vertices are snapped to 1/1024 of the samples' distance, after which coverage is exact integer arithmetic. A sample
/// on an edge counts as one slightly to its right, and on a horizontal edge as one slightly below it: so in a sheet it
/// is covered once, and at a fold twice or not at all. The number of preserving minus reversing triangles is the degree
/// of the snapped map everywhere. Labels are linear on the snapped triangles and never outside of their triangle.
/// Triangles without area cover nothing. Cells with a vertex further than 2^19 samples from the origin, where the
/// arithmetic would overflow, are left out as if it were NaN.
///
/// The mesh is not copied where it is moved in, nor by for_counts(); the rest takes a quarter of a byte per cell, and a
/// band about 18 bytes per sample. All members are thread-safe; bands do not depend on each other, on their size or on
/// the number of threads.
class MeshRaster {
 public:
  /// @param priority one per cell, row by row, for SheetOrder::kPriority only
  /// @throws InputError for sizes or a supersampling out of range (an output of more than 2^18 samples in a row or
  /// column is), for a mesh as DeformedMesh::check, for priorities that are missing, superfluous or NaN
  MeshRaster(DeformedMesh mesh, const RasterOptions& options, std::vector<float> priority = {});

  /// The same mesh and bands with the samples by which sheets are counted, whatever the supersampling: 2×2 per pixel.
  /// (One, at the centre, lies on the axis of symmetric shapes, where many cells are squeezed together: two discs that
  /// pass each other were counted 13 times there, five times beside it.) Of an output whose sides would be too long
  /// one. Of several sheets the first is on top.
  MeshRaster for_counts() const;

  const RasterOptions& options() const { return options_; }
  const DeformedMesh& mesh() const { return *mesh_; }
  int bands() const;

  /// The sheets on top; for SheetOrder::kAverage, which is made of sheet(), the least stretched.
  /// @param index 0 to bands() − 1 @throws InputError for another
  RasterBand band(int index) const;

  /// The n-th of the sheets that cover each sample, in row-by-row order of triangles, from 0; `counts` is as in band().
  /// Takes as long as band(). @throws InputError if n is not between 0 and 254
  RasterBand sheet(int index, int n) const;

 private:
  // The sample rows that a block of cells may cover; none where last < first.
  struct SampleRows {
    std::int32_t first, last;
  };

  MeshRaster(std::shared_ptr<const DeformedMesh> mesh, const RasterOptions& options, std::vector<float> priority);

  RasterBand empty_band(int index) const;
  bool is_of_block(std::vector<SplitCell>::const_iterator cell, int row, int end) const;
  SampleRows rows_of_block(int block, int row) const;
  template <class Writer>
  void write_cells(Writer& writer) const;
  template <class Writer>
  void write_block(Writer& writer, int block, int row) const;
  template <class Writer>
  void write_split(Writer& writer, const SplitCell& cell, float priority) const;

  std::shared_ptr<const DeformedMesh> mesh_;
  RasterOptions options_;
  std::vector<float> priority_;
  int blocks_per_row_ = 0;
  std::vector<SampleRows> block_rows_;  ///< row by row
};

/// How a band, or the sum of several, is covered.
struct Coverage {
  int max_multiplicity = 0;
  std::int64_t samples = 0;
  std::int64_t uncovered = 0;

  /// Samples without any sheet over all samples.
  double uncovered_fraction() const;
  Coverage& operator+=(const Coverage& other);
};

Coverage coverage(const RasterBand& band);

/// The pixels of a band none of whose samples is covered, row by row.
std::vector<bool> uncovered_pixels(const RasterBand& band);

/// The pixels of `mask` that are not 4-connected to the border within the mask:
/// the holes, where `mask` is what is uncovered. @param mask width·height, row by row @throws InputError if it is not
/// so
std::vector<bool> enclosed(const std::vector<bool>& mask, int width, int height);

}  // namespace pulson::warp
