#pragma once

// The formats behind read_grid_field and write_grid_field, MetaImage and NRRD, and what they share: headers, which are
// lines of a key and its value, and numbers as bytes.

#include <cstddef>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/fields/grid_fields.hpp"

namespace pulson::fields {

/// What is asked of a file.
struct GridLimits {
  std::uint64_t max_points;
  bool any_components;  ///< else as a GridField has them
};

/// The numbers of the field in its type, and those of the grid as floats.
Grid grid_of(const GridField& field);
GridField field_of(Grid grid);

bool sniff_meta_image(std::string_view text);
/// `path` is what messages call the file. @throws InputError
Grid read_meta_image(const std::string& path, std::string_view text, const GridLimits& limits);
/// The whole file. The grid's direction is filled.
std::string meta_image_file(const Grid& grid, bool compressed);

bool sniff_nrrd(std::string_view text);
Grid read_nrrd(const std::string& path, std::string_view text, const GridLimits& limits);
std::string nrrd_file(const Grid& grid, bool compressed);

/// One line of a header.
struct HeaderEntry {
  std::size_t line;
  std::string key;         ///< as the file has it
  std::string_view value;  ///< trimmed
};

/// The entries of a header by their keys, of which case and blanks do not matter. What is looked up by several keys has
/// several names in the format. All errors are InputError "path:line: message".
class GridHeader {
 public:
  explicit GridHeader(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }

  /// Keys may not come twice. @throws InputError if one does
  void add(std::size_t line, std::string_view key, std::string_view value);

  /// The entry of the first of these keys that is there, or nullptr.
  const HeaderEntry* find(std::initializer_list<std::string_view> keys) const;

  /// The same where it has to be there. @throws InputError
  const HeaderEntry& need(std::initializer_list<std::string_view> keys) const;

  /// `count` finite numbers, between blanks. @throws InputError
  std::vector<double> numbers(const HeaderEntry& entry, std::string_view text, std::size_t count) const;

  /// The same, whole and from 1 to the largest int. @throws InputError
  std::vector<int> counts(const HeaderEntry& entry, std::size_t count) const;

  /// Those of other keys than these, in the order of the file.
  std::vector<std::pair<std::string, std::string>> others(std::span<const std::string_view> keys) const;

  /// @throws InputError "path:line: key is 'value'; what"
  [[noreturn]] void refuse(const HeaderEntry& entry, const std::string& what) const;

 private:
  std::string path_;
  std::map<std::string, HeaderEntry> entries_;
};

/// Takes a line, without its end, off the front of `text`.
std::string_view take_header_line(std::string_view& text);

/// A type of numbers, by its names in files.
struct GridNumberType {
  std::string_view meta_image;  ///< several, with commas between
  std::string_view nrrd;        ///< the same
  GridType type;

  /// The first of the names.
  std::string_view meta_image_name() const { return meta_image.substr(0, meta_image.find(',')); }
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

/// All numbers of a grid, as they are in memory. @throws InputError that names `path`, before anything is allocated, if
/// there are more than `max_points` points or the bytes cannot be of so many; and if they are damaged
std::vector<std::byte> grid_bytes(const std::string& path, const GridBytes& bytes, const std::vector<int>& sizes,
                                  int components, std::uint64_t max_points);

enum class GridEncoding { kRaw, kZlib, kGzip };

/// The numbers, little-endian.
std::string encoded(std::span<const std::byte> bytes, GridEncoding encoding);

}  // namespace pulson::fields
