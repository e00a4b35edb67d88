#pragma once

// The columns of a table: what their names mean, and which holds what.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "csv_records.hpp"

namespace pulson::io {

enum class ColumnRole { kX, kY, kZ, kLabel, kGroup, kSpecimen, kDefined };

/// A column by its name. Of several columns with one role, the one of the lowest rank has it.
struct ColumnMeaning {
  ColumnRole role;
  int rank;
  std::string unit = {};  ///< of a coordinate: mm, px, ...
};

constexpr int kLandmarkRank = 0;  ///< of a label: `landmark`, `point`
constexpr int kNameRank = 1;      ///< `label`, `name`, which may mean a specimen as well
constexpr int kIdRank = 2;        ///< `id`, which may too
constexpr int kIndexRank = 3;     ///< `index`, `no`
constexpr int kImageRank = 2;     ///< of a specimen: `file`, `image`
constexpr int kFrameRank = 3;     ///< `frame`

/// Case, blanks and `_ . -` do not matter. Coordinates may be `X (mm)`, `x_px`, `Xcoord`, `pos_x`, `Points:0`.
std::optional<ColumnMeaning> meaning_of(std::string_view name);

/// In lower case, without blanks and `_ . -`.
std::string plain_name(std::string_view name);

bool is_coordinate(ColumnRole role);

/// 0, 1, 2 for x, y, z, which may be followed by `coordinates` and the like: `x-coordinates`, `Y coord`.
std::optional<std::size_t> axis_of_word(std::string_view word);

/// The column of the lowest rank with this role, counted from 0.
std::optional<std::size_t> find_column(const CsvRecord& header, ColumnRole role);

struct RankedColumn {
  std::size_t column;
  int rank;
};

/// All columns of this role, those of the lowest rank first.
std::vector<RankedColumn> find_columns(const CsvRecord& header, ColumnRole role);

/// Which column of a table holds what, counted from 0.
struct CsvColumns {
  std::vector<std::size_t> coordinates;  ///< d columns: x, y, z
  std::optional<std::size_t> label;
  std::optional<std::size_t> group;
  std::vector<std::size_t> specimen;  ///< set in a long table: one shape per specimen, which these name together
  std::optional<std::size_t> image;
  std::optional<std::size_t> defined;  ///< 0: the landmark is missing
  bool are_numbered = false;           ///< the landmarks, by a column that counts them
  std::vector<std::string> unused;     ///< names of columns that mean nothing here
  std::vector<std::string> notes;      ///< what was chosen by what the columns hold
  std::string units;
  std::string axes;  ///< `LPS`, `RAS`
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

/// Whether a header names coordinates: x, y, z in one of their ways, `l,p,s` or `r,a,s` of 3D Slicer, `axis-0,axis-1`
/// of napari.
bool names_coordinates(const CsvRecord& header);

/// Whether one of the columns is just `x`, `y`, `z` or `pos1` and so on.
bool names_plain_coordinates(const CsvRecord& header);

/// The columns of a table whose first record is its header. @throws InputError if coordinates are absent or incomplete,
/// two columns have the same meaning, or lines have other numbers of fields.
CsvColumns columns_of_header(const std::string& path, const std::vector<CsvRecord>& records);

/// Chooses the columns that name landmarks and specimens: by their names and, where those may mean either, by whether
/// their values repeat in runs. @throws InputError if two mean the same, or if a column that is not used looks as if it
/// distinguished shapes.
void choose_names(const std::string& path, const std::vector<CsvRecord>& records, CsvColumns& columns);

/// Whether the values of a column are 0, 1, 2, ... or 1, 2, 3, ... from record `begin` on.
bool counts_lines(const std::vector<CsvRecord>& records, std::size_t column, std::size_t begin);

/// Names the columns that R leaves without a name: row names, where the header is one field short of all lines, and x,
/// y, z for `V1,V2[,V3]`, or label and these where V1 holds text.
void name_unnamed_columns(std::vector<CsvRecord>& records);

/// The fields of these columns that are not empty, with `/` between.
std::string joined_fields(const CsvRecord& record, const std::vector<std::size_t>& columns);

/// Whether a name ends as those of images do.
bool names_image(std::string_view text);

/// A table without header: label,x,y[,z].
CsvColumns columns_of_named_points(const CsvRecord& first);

/// A table without header: x[,y[,z]]. @throws InputError if `first` has other than 1 to 3 numbers.
CsvColumns columns_without_header(const std::string& path, const CsvRecord& first);

}  // namespace pulson::io
