#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "csv_records.hpp"

namespace pulson::io {

/// What a column means by its name.
enum class ColumnRole { kX, kY, kZ, kLabel, kGroup, kSpecimen };

std::optional<ColumnRole> role_of(std::string_view name);

/// The first column of this role, counted from 0.
std::optional<std::size_t> find_column(const CsvRecord& header, ColumnRole role);

/// 0, 1, 2 for x, y, z, which may be followed by `coordinates` and the like: `x-coordinates`, `Y coord`.
std::optional<std::size_t> axis_of_word(std::string_view word);

/// Which column of a table holds what, counted from 0.
struct CsvColumns {
  std::vector<std::size_t> coordinates;  ///< d columns: x, y, z
  std::optional<std::size_t> label;
  std::optional<std::size_t> group;
  std::optional<std::size_t> specimen;  ///< set in a long table: one shape per specimen
  std::vector<std::string> unused;      ///< names of columns that mean nothing here
};

/// Whether the first line of a table names its columns: it holds words and no number. Marks of missing values alone are
/// no header.
bool is_header(const CsvRecord& record);

bool is_number_or_missing(const std::string& field);

/// Whether each line is a name and two or three coordinates. Names before one number are any list of values.
bool holds_named_points(const std::vector<CsvRecord>& records);

/// Whether each field of a line is a number or the mark of a missing one.
bool holds_numbers(const CsvRecord& record);

/// Whether a line holds nothing but marks of missing values.
bool holds_only_marks(const CsvRecord& record);

/// Whether a header names any coordinate.
bool names_coordinates(const CsvRecord& header);

/// @throws InputError if coordinates are absent or incomplete, or two columns have the same meaning.
CsvColumns columns_of_header(const std::string& path, const CsvRecord& header);

/// A table without header: label,x,y[,z].
CsvColumns columns_of_named_points(const CsvRecord& first);

/// A table without header: x[,y[,z]]. @throws InputError if `first` has other than 1 to 3 numbers.
CsvColumns columns_without_header(const std::string& path, const CsvRecord& first);

}  // namespace pulson::io
