#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace pulson::io {

/// One line of a table, split into fields: blanks around a field and the quotes around it are taken off.
struct CsvRecord {
  std::size_t line;
  std::vector<std::string> fields;
  bool follows_blank_line = false;
  bool follows_empty_row = false;  ///< a line of empty cells alone, as Excel writes it
};

/// The lines of a table but blank ones, comments (`#`, `//`) and those of empty cells alone, at most `limit` of them.
/// Fields are separated by what a first line `sep=;` names, else by the first of ; , tab that the first line has
/// outside quotes, else by blanks; a tab goes before commas that all stand between digits. Last columns that are empty,
/// without a name too, are left out. A comment just above the first line that names coordinates, as many as that line
/// has fields, is the header. The numbers may have decimal commas (1,5), between commas in quotes, which become points,
/// if no number has a point or several commas. @throws InputError on a broken quote.
std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text,
                                   std::size_t limit = std::string::npos);

/// Whether each comma stands between two digits, as in `1,5`.
bool commas_may_be_decimal(std::string_view text);

/// Makes the decimal commas of numbers points, if some number has one and none says that commas or points are anything
/// else. Columns that hold names stay as they are; between commas, numbers such as 1,234 alone say nothing.
void use_decimal_points(std::vector<CsvRecord>& records, char delimiter);

}  // namespace pulson::io
