#pragma once

// Tables: their lines and fields, what the names of columns mean and which holds what, and layouts other than a
// landmark per line.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// One line of a table, split into fields: blanks around a field and the quotes around it are taken off, and blanks
/// within the quotes. A field in quotes may go on over several lines.
struct CsvRecord {
  std::size_t line;  ///< the first
  std::vector<std::string> fields;
  bool follows_blank_line = false;
  bool follows_empty_row = false;  ///< a line of empty cells alone, as Excel writes it
  std::size_t comment_row = 0;     ///< the first comment after it that looks like a row of the table; 0: none
  /// Of those fields in quotes that have outer blanks within them: column and field with these.
  std::vector<std::pair<std::size_t, std::string>> padded{};

  /// A name as it stands in the table, to the byte; fields[column] but for blanks within quotes.
  const std::string& name(std::size_t column) const;
};

/// The lines of a table, with those that fields in quotes hold, but blank ones, comments (`#`, `//`) and those of empty
/// cells alone, at most `limit` of them. Fields are separated by what a first line `sep=;` names, else by the first of
/// ; , tab that the first line has outside quotes, else by blanks; a tab goes before commas that all stand between
/// digits. Last columns that are empty, without a name too, are left out. A comment just above the first line that
/// names coordinates, as many as that line has fields, is the header. The numbers may have decimal commas (1,5),
/// between commas in quotes, which become points, if no number has a point or several commas. @throws InputError on a
/// broken quote.
std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text,
                                   std::size_t limit = std::string::npos);

/// Whether each comma stands between two digits, as in `1,5`.
bool commas_may_be_decimal(std::string_view text);

/// What is between the fields of a table; a blank stands for any number of blanks and tabs. Nothing where it has no
/// lines. @throws InputError as csv_records() does
std::optional<char> csv_delimiter(const std::string& path, std::string_view text);

/// Whether a line, trimmed, is a comment: it begins with `#` or `//`; `#N/A` is a cell of Excel.
bool is_csv_comment(std::string_view content);

/// Whether a line, trimmed, is Excel's first line `sep=;`.
bool names_csv_delimiter(std::string_view content);

/// A place of a file, from the byte `begin` to `end`.
struct CsvSpan {
  std::size_t begin;
  std::size_t end;
};

/// The fields of the record that begins at the byte `at` of `text`, without the quotes and the blanks around them.
/// @return where its last line ends
std::size_t csv_spans(std::string_view text, std::size_t at, char delimiter, char line_end,
                      std::vector<CsvSpan>& fields);

/// Whether a number with the comma `1,234` may be one of thousands.
bool may_have_thousands(std::string_view number);

/// Makes the decimal commas of numbers points, if some number has one and none says that commas or points are anything
/// else. Columns that hold names stay as they are; between commas, numbers such as 1,234 alone say nothing.
void use_decimal_points(std::vector<CsvRecord>& records, char delimiter);

/// The first `count` lines of `text`, for a look at what it is: none where it is no table.
std::vector<CsvRecord> first_records(std::string_view text, std::size_t count);

/// The name repeats with each shape, so that a long one would take far more memory than the file has.
/// @throws InputError if it is
void require_short_name(const std::string& path, const CsvRecord& record, const std::string& name);

enum class ColumnRole { kX, kY, kZ, kLabel, kGroup, kSpecimen, kDefined, kAbsent };

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
  std::optional<std::size_t> absent;   ///< 1: the specimen does not have it
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

/// Its columns of coordinates, units, axes and notes alone. @throws InputError if coordinates are absent or incomplete
CsvColumns coordinates_of_header(const std::string& path, const CsvRecord& header);

/// Chooses the columns that name landmarks and specimens: by their names and, where those may mean either, by whether
/// their values repeat in runs. @throws InputError if two mean the same, or if a column that is not used looks as if it
/// distinguished shapes.
void choose_names(const std::string& path, const std::vector<CsvRecord>& records, CsvColumns& columns);

/// Whether the values of a column are 0, 1, 2, ... or 1, 2, 3, ... from record `begin` on.
bool counts_lines(const std::vector<CsvRecord>& records, std::size_t column, std::size_t begin);

/// Names the columns that R leaves without a name: row names, where the header is one field short of all lines, and x,
/// y, z for `V1,V2[,V3]`, or label and these where V1 holds text.
void name_unnamed_columns(std::vector<CsvRecord>& records);

/// Makes a first line that counts its columns, `ID 1 2 3 ...` or `,0,1`, name them V1, V2, ...
void name_numeric_header(std::vector<CsvRecord>& records);

/// Takes a first line off that holds the number of lines after the header alone, as in the tables of CelebA.
void drop_count_line(std::vector<CsvRecord>& records);

/// Takes last lines off that summarise the others: `Mean`, `SD`, `Min`, `Max`. @return the note
std::vector<std::string> drop_summary_rows(const std::string& path, std::vector<CsvRecord>& records);

/// Whether four columns or more count the coordinates of a shape: `ProcCoord1, ProcCoord2, ...`, `V1, V2, ...`
bool numbers_coordinates(const CsvRecord& header);

/// Names these columns x1, y1, x2, ... @param dimension of the landmarks; 0: found @return the note where two are
/// possible @throws InputError where it cannot be found
std::vector<std::string> name_numbered_coordinates(const std::string& path, std::vector<CsvRecord>& records,
                                                   int dimension);

/// The fields of these columns that are not empty, with `/` between.
std::string joined_fields(const CsvRecord& record, const std::vector<std::size_t>& columns);

/// Whether a name ends as those of images do.
bool names_image(std::string_view text);

/// A table without header: label,x,y[,z].
CsvColumns columns_of_named_points(const CsvRecord& first);

/// A table without header: x[,y[,z]]. @throws InputError if `first` has other than 1 to 3 numbers.
CsvColumns columns_without_header(const std::string& path, const CsvRecord& first);

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

/// The columns of x, y and perhaps z of each landmark of such a table. @throws InputError if one is not there
std::vector<std::vector<std::size_t>> columns_of_shape_rows(const std::string& path, const CsvRecord& header);

/// An axis per line, without header: [name,]x-coordinates,1,2,3,... then y and perhaps z, and so on for each shape.
bool fits_named_axis_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_named_axis_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// Two or three lines of many numbers: all x, all y and perhaps all z.
bool fits_axis_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_axis_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// A shape per line, without header, and its centroid size as the last number, as IMP writes them.
bool fits_size_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_size_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// Whether lines of numbers, but for their last, are nearly the same: shapes rather than axes of one.
bool are_alike(const std::vector<CsvRecord>& records);

/// A shape per line, without header: a name and the coordinates of its landmarks, four numbers or more, x1, y1, x2, y2,
/// ...
bool fits_named_shape_rows(const std::vector<CsvRecord>& records);
LandmarkFile read_named_shape_rows(const std::string& path, const std::vector<CsvRecord>& records);

/// How many coordinates each landmark of such a line has. @throws InputError where that is not certain
std::size_t dimension_of_named_shape(const std::string& path, const CsvRecord& first);

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

}  // namespace pulson::formats
