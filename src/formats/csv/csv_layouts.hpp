#pragma once

// The layouts of a table of numbers other than a landmark per line, what their readers share, and tables that
// ReadOptions describe.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "csv_records.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::io {

/// One row of the table of layouts.
struct CsvLayout {
  /// Whether a table has this layout; `records` are all of its lines, or the first of them.
  bool (*fits)(const std::vector<CsvRecord>& records);
  LandmarkFile (*read)(const std::string& path, const std::vector<CsvRecord>& records);
};

/// The first layout that fits; null for a table with a landmark per line. `records` are not empty.
const CsvLayout* find_layout(const std::vector<CsvRecord>& records);

/// A coordinate per line: columns axis, value, landmark[, specimen][, group], lines in any order.
bool fits_coordinate_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_coordinate_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// A shape per line: columns x1, y1, x2, y2, ... or 1.X, 1.Y, ... or nose_x, nose_y, ... in any order, others may name
/// the shape.
bool fits_shape_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_shape_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// An axis per line, without header: [name,]x-coordinates,1,2,3,... then y and perhaps z, and so on for each shape.
bool fits_named_axis_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_named_axis_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// Two or three lines of many numbers: all x, all y and perhaps all z.
bool fits_axis_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_axis_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// A shape per line, without header: a name and the coordinates of its landmarks, four numbers or more, x1, y1, x2, y2,
/// ...
bool fits_named_shape_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_named_shape_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// @throws InputError if a line has more or fewer fields than the first.
void require_equal_lengths(const std::string& path, const std::vector<CsvRecord>& records);

/// The warning of columns that mean nothing here, if there are any.
std::vector<std::string> unused_columns(const std::string& path, const std::vector<std::string>& names);

/// Whether the labels are 1, 2, 3, ..., which says nothing that the order of the landmarks does not.
bool counts_from_one(const std::vector<std::string>& labels);

/// A column as `X1` or `1.X` names it, or `nose_x`.
struct CoordinateName {
  std::size_t axis;
  std::optional<std::size_t> number;  ///< of the landmark
  std::string label;                  ///< where it has no number
};

/// `X1`, `1.X`, `LM 1_X`, `x[1]`
std::optional<CoordinateName> parse_numbered_coordinate(std::string_view name);

/// `nose_x`, `nose.X`, `noseX`, `L1x` or `x_nose`
std::optional<CoordinateName> parse_named_coordinate(std::string_view name);

/// Gives the columns that `columns` lists (x → he_col) names with this meaning, and other columns that have it others.
/// @throws InputError that lists the columns where one is not there, or where the table has no header
void name_columns(const std::string& path, CsvRecord& header, const std::map<std::string, std::string>& columns);

/// Whether each line holds one field.
bool is_one_column(const std::vector<CsvRecord>& records);

/// One shape of a table of one column, where the d coordinates of each landmark take turns.
LandmarkFile read_in_turn(const std::string& path, const std::vector<CsvRecord>& records, std::size_t dimension);

}  // namespace pulson::io
