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
};

/// The lines of a table but blank ones and comments ('#'), at most `limit` of them. Fields are separated by the first
/// of ; , tab that the first line has outside quotes, else by blanks; a tab goes before commas that all stand between
/// digits. Between ; or tabs the numbers may have decimal commas (1,5), which become points, if no number has a point
/// or several commas. @throws InputError on a broken quote.
std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text,
                                   std::size_t limit = std::string::npos);

}  // namespace pulson::io
