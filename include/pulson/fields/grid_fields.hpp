#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/number_type.hpp"

namespace pulson::fields {

using GridType = NumberType;

/// Numbers on a regular grid, an image or a field of displacements. Grid point (i, j[, k]) lies at
///   x = origin + direction · diag(spacing) · (i, j[, k]),
/// and the displacements are vectors in the space of x, in its length units, regardless of the direction of the grid.
/// ITK and what is built on it (3D Slicer, SimpleITK, ANTs) apply them as out(x) = image(x + field(x)): a field that
/// carries an image from source to target holds source_from_target(x) − x at each x of the target.
struct GridField {
  std::vector<int> sizes;       ///< along each axis; d = 2 or 3 of them
  std::vector<double> spacing;  ///< d, length units, > 0
  std::vector<double> origin;   ///< d, length units: the place of the first grid point
  int components = 1;           ///< of the value at a point: 1, a scalar, or d, a displacement
  std::vector<float>
      values;  ///< of whatever type in the file, so rounded to float; the component runs fastest, then x, y, z
  Eigen::MatrixXd direction = {};  ///< d×d, column k is the unit vector of grid axis k; empty: the identity
  GridType type =
      GridType::kFloat32;  ///< in the file; whole types take the nearest number that they have, and 0 for NaN
};

/// A grid with its numbers as its file has them: what GridField is of, with numbers of any type and any number of
/// components, as an image of channels.
struct Grid {
  std::vector<int> sizes;          ///< as of GridField
  std::vector<double> spacing;     ///< the same
  std::vector<double> origin;      ///< the same
  int components = 1;              ///< of the value at a point
  Eigen::MatrixXd direction = {};  ///< as of GridField
  GridType type = GridType::kFloat32;
  std::vector<std::byte> bytes = {};  ///< the numbers in memory; the component runs fastest, then x, y, z
  bool is_compressed = true;          ///< in the file
  std::string kind = {};              ///< of the components, as NRRD names them: vector, RGB-color; or empty
  /// Keys and values that say nothing of the numbers' places: comments, names; of NRRD those of `key:=value`.
  std::vector<std::pair<std::string, std::string>> lines = {};
};

/// The most points of a grid unless more are asked for: volumes of 1024³ pass, and take 4 GB.
inline constexpr std::uint64_t kMaxGridPoints = std::uint64_t{1} << 30U;

/// Writes MetaImage (`.mha`) or NRRD (`.nrrd`), by the extension, little-endian in one file, with zlib or raw,
/// by write_file_atomically. Coordinates are written as they are: nothing is flipped or scaled, and headers call
/// those in 3D left-posterior-superior, as ITK's do, since that is what ITK and 3D Slicer take them for.
/// @throws InputError if the extension is another one, the field's parts disagree, or the file cannot be written
void write_grid_field(const std::filesystem::path& path, const GridField& field, bool compressed = true);

/// Reads a MetaImage or NRRD file, recognised by its content: scalars or d-vectors in 2D or 3D of whole numbers or
/// floating-point numbers, raw or by zlib, in either byte order; `direction` is always filled, and `type` is the
/// file's. Coordinates are as the file has them; a NRRD file of another space than left-posterior-superior, as
/// right-anterior-superior, is refused, as are headers that point to data in other files. @throws InputError that names
/// the file and what is wrong, also where it is no regular file or its grid has more than `max_points`; nothing of the
/// size that a header claims is allocated unless the file can hold it
GridField read_grid_field(const std::filesystem::path& path, std::uint64_t max_points = kMaxGridPoints);

// The same with numbers and lines as they are. @throws InputError as those above, but for the number of components
void write_grid(const std::filesystem::path& path, const Grid& grid);
Grid read_grid(const std::filesystem::path& path, std::uint64_t max_points = kMaxGridPoints);

}  // namespace pulson::fields
