#pragma once

// The numbers of MetaImage and NRRD files as bytes.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/fields/grid_fields.hpp"

namespace pulson::io {

/// A type of numbers, by its names in files.
struct GridNumberType {
  std::string_view meta_image;
  std::string_view nrrd;  ///< several, with commas between
  GridType type;
  std::size_t size;  ///< in bytes
  void (*decode)(const char* bytes, bool is_big_endian, std::span<float> values);
  void (*encode)(std::span<const float> values, char* bytes);  ///< little-endian

  /// The first of the names in NRRD.
  std::string_view nrrd_name() const { return nrrd.substr(0, nrrd.find(',')); }
};

/// nullptr where the name is not known.
const GridNumberType* find_meta_image_type(std::string_view name);
const GridNumberType* find_nrrd_type(std::string_view name);
const GridNumberType& grid_number_type(GridType type);

/// How many numbers a grid has; none where that is more than memory has addresses for.
std::optional<std::size_t> grid_count(const std::vector<int>& sizes, int components);

/// What follows a header.
struct GridBytes {
  std::string_view bytes;
  const GridNumberType& type;
  bool is_big_endian;
  bool is_compressed;  ///< as a zlib or gzip stream, which one follows from the bytes
};

/// All numbers of a grid. @throws InputError that names `path`, before anything is allocated, if the bytes cannot be of
/// so many; and if they are damaged
std::vector<float> grid_values(const std::string& path, const GridBytes& bytes, const std::vector<int>& sizes,
                               int components);

enum class GridEncoding { kRaw, kZlib, kGzip };

/// The values as bytes, little-endian.
std::string encoded(std::span<const float> values, GridType type, GridEncoding encoding);

}  // namespace pulson::io
