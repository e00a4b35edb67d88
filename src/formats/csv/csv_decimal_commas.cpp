#include "csv_decimal_commas.hpp"

#include <optional>
#include <set>

#include "core/text.hpp"
#include "csv_columns.hpp"

namespace pulson::io {
namespace {

bool is_all_of(std::string_view text, std::string_view characters) {
  return text.find_first_not_of(characters) == std::string_view::npos;
}

bool looks_like_number(std::string_view field) {
  return is_all_of(field, "+-0123456789.,eE") && field.find_first_of("0123456789") != std::string_view::npos;
}

/// Where the decimal comma of `1,5` or `-1,5e3` is; npos where the field is no such number.
std::size_t find_decimal_comma(std::string_view field) {
  const std::size_t comma = field.find(',');
  const bool is_decimal = comma != std::string_view::npos && field.find_first_of(".,", comma + 1) == field.npos &&
                          field.find('.') == field.npos && looks_like_number(field) && commas_may_be_decimal(field);
  return is_decimal ? comma : std::string_view::npos;
}

/// Columns that hold names by the header, whatever they look like.
std::set<std::size_t> columns_of_names(const CsvRecord& header) {
  std::set<std::size_t> columns;
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (const std::optional<ColumnMeaning> meaning = meaning_of(header.fields[i]))
      if (!is_coordinate(meaning->role)) columns.insert(i);
  return columns;
}

/// `1,234`, which is a number without decimals elsewhere
bool may_have_thousands(std::string_view field, std::size_t comma) {
  const std::size_t begin = field.find_first_of("0123456789");
  return field.size() == comma + 4 && comma - begin <= 3 && field[begin] != '0';
}

/// Whether some number has a decimal comma and none says that commas or points are anything else.
bool has_decimal_commas(const std::vector<CsvRecord>& records, char delimiter, const std::set<std::size_t>& names) {
  bool has_any = false;
  for (const CsvRecord& record : records)
    for (std::size_t i = 0; i < record.fields.size(); ++i) {
      const std::string& field = record.fields[i];
      if (names.contains(i) || !looks_like_number(field) || is_all_of(field, "+-0123456789eE")) continue;
      const std::size_t comma = find_decimal_comma(field);
      if (comma == std::string::npos) return false;
      if (delimiter != ',' || !may_have_thousands(field, comma)) has_any = true;
    }
  return has_any;
}

}  // namespace

bool commas_may_be_decimal(std::string_view text) {
  for (std::size_t i = text.find(','); i != std::string_view::npos; i = text.find(',', i + 1))
    if (i == 0 || i + 1 == text.size() || !is_digit(text[i - 1]) || !is_digit(text[i + 1])) return false;
  return true;
}

void use_decimal_points(std::vector<CsvRecord>& records, char delimiter) {
  if (records.empty()) return;
  const std::set<std::size_t> names = columns_of_names(records.front());
  if (!has_decimal_commas(records, delimiter, names)) return;
  for (CsvRecord& record : records)
    for (std::size_t i = 0; i < record.fields.size(); ++i)
      if (const std::size_t comma = find_decimal_comma(record.fields[i]); comma != std::string::npos)
        if (!names.contains(i)) record.fields[i][comma] = '.';
}

}  // namespace pulson::io
