#pragma once

// The numbers of MetaImage and NRRD files as bytes.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pulson::io {

/// A type of numbers, by its names in files.
struct GridNumberType {
  std::string_view meta_image;
  std::string_view nrrd;  ///< several, with commas between
  std::size_t size;       ///< in bytes
  void (*convert)(const char* bytes, bool is_big_endian, std::span<float> values);
};

/// nullptr where the name is not known.
const GridNumberType* find_meta_image_type(std::string_view name);
const GridNumberType* find_nrrd_type(std::string_view name);

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

/// The values as bytes, little-endian floats.
std::string encoded(std::span<const float> values, GridEncoding encoding);

}  // namespace pulson::io
