#pragma once

#include <optional>
#include <string>
#include <vector>

#include "csv_records.hpp"

namespace pulson::io {

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

/// Whether each field of a line is a number or the mark of a missing one.
bool holds_numbers(const CsvRecord& record);

/// Whether a line holds nothing but marks of missing values.
bool holds_only_marks(const CsvRecord& record);

/// Whether a header names any coordinate.
bool names_coordinates(const CsvRecord& header);

/// @throws InputError if coordinates are absent or incomplete, or two columns have the same meaning.
CsvColumns columns_of_header(const std::string& path, const CsvRecord& header);

/// A table without header: x[,y[,z]]. @throws InputError if `first` has other than 1 to 3 numbers.
CsvColumns columns_without_header(const std::string& path, const CsvRecord& first);

}  // namespace pulson::io
