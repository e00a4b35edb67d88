#include "core/csv_table.hpp"

#include <array>
#include <cmath>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::text {
namespace {

constexpr std::string_view kFormulaBegins = "=+-@\t\r";

bool needs_quotes(std::string_view text) {
  return text.find_first_of(",;\t\"# \r\n") != std::string_view::npos || text.starts_with("//") ||
         (!text.empty() && kFormulaBegins.find(text.front()) != std::string_view::npos);
}

}  // namespace

CsvTable::CsvTable(std::initializer_list<std::string_view> header) { words(header).end_row(); }

CsvTable& CsvTable::text(std::string_view cell) {
  return is_utf8(cell) ? raw(csv_quoted(cell)) : text(utf8_of_windows_1252(cell));
}

CsvTable& CsvTable::word(std::string_view cell) {
  if (!is_utf8(cell)) return word(utf8_of_windows_1252(cell));
  return needs_quotes(cell) ? text(cell) : raw(cell);
}

CsvTable& CsvTable::words(std::initializer_list<std::string_view> cells) {
  for (const std::string_view cell : cells) word(cell);
  return *this;
}

CsvTable& CsvTable::end_row() {
  text_ += '\n';
  begins_row_ = true;
  return *this;
}

void CsvTable::separate() {
  if (!begins_row_) text_ += ',';
  begins_row_ = false;
}

CsvTable& CsvTable::raw(std::string_view cell) {
  separate();
  text_ += cell;
  return *this;
}

CsvTable& CsvTable::real(double value) {
  if (!std::isfinite(value)) return missing();
  std::array<char, 40> digits;  // the fewest are at most 24: -2.2250738585072014e-308
  const char* const end = fmt::format_to(digits.data(), FMT_COMPILE("{}"), value);
  return raw({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

CsvTable& CsvTable::whole(std::int64_t value) {
  const fmt::format_int digits(value);
  return raw({digits.data(), digits.size()});
}

CsvTable& CsvTable::natural(std::uint64_t value) {
  const fmt::format_int digits(value);
  return raw({digits.data(), digits.size()});
}

std::string spreadsheet_safe(std::string_view csv) {
  std::string safe;
  safe.reserve(csv.size());
  bool inside_quotes = false;
  bool is_doubled = false;  // whether a quote that opens is the second of two
  for (std::size_t i = 0; i < csv.size(); ++i) {
    safe += csv[i];
    if (csv[i] != '"') continue;
    inside_quotes = !inside_quotes;
    is_doubled = inside_quotes && i > 0 && csv[i - 1] == '"';
    const bool begins_formula = i + 1 < csv.size() && kFormulaBegins.find(csv[i + 1]) != std::string_view::npos;
    if (inside_quotes && !is_doubled && begins_formula) safe += '\'';
  }
  return safe;
}

}  // namespace pulson::text
