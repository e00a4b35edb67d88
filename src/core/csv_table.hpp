#pragma once

// The one writer of tables as csv.

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace pulson::text {

/// The text of a table, cell by cell: RFC 4180 but for its line ends, which are LF. Commas are between the cells; cells
/// in quotes may hold anything, also line breaks and outer blanks, and quotes in them are doubled. Every text that
/// begins with one of `= + - @` or a blank stands in quotes, and no number does. What is not UTF-8 is read as
/// Windows-1252, as in landmark files.
class CsvTable {
 public:
  CsvTable() = default;
  /// @param header the names of the columns, as words
  explicit CsvTable(std::initializer_list<std::string_view> header);

  /// A text in quotes: a name of the user's, a specification.
  CsvTable& text(std::string_view cell);
  /// A text that stands in quotes only where it has to.
  CsvTable& word(std::string_view cell);
  CsvTable& words(std::initializer_list<std::string_view> cells);

  /// In the fewest digits that read back to the same bits; what is not finite is NA.
  template <std::floating_point Number>
  CsvTable& number(Number value) {
    return real(value);
  }
  template <std::signed_integral Number>
  CsvTable& number(Number value) {
    return whole(std::int64_t{value});
  }
  template <std::unsigned_integral Number>
    requires(!std::same_as<Number, bool>)
  CsvTable& number(Number value) {
    return natural(std::uint64_t{value});
  }
  /// A cell each. @param values a column of Eigen's, a list or other range
  template <class Values>
  CsvTable& numbers(const Values& values) {
    for (const auto value : values) number(value);
    return *this;
  }
  template <class... Numbers>
    requires(sizeof...(Numbers) > 1)
  CsvTable& numbers(const Numbers&... values) {
    (number(values), ...);
    return *this;
  }

  /// NA, as R writes it.
  CsvTable& missing() { return raw("NA"); }
  CsvTable& empty() { return raw(""); }
  /// Cells that another table wrote, without the end of their row.
  CsvTable& cells(std::string_view of_row) { return raw(of_row); }
  CsvTable& end_row();

  std::string take() && { return std::move(text_); }

 private:
  void separate();
  CsvTable& raw(std::string_view cell);
  CsvTable& real(double value);
  CsvTable& whole(std::int64_t value);
  CsvTable& natural(std::uint64_t value);

  std::string text_;
  bool begins_row_ = true;
};

/// What CsvTable wrote, made fit for spreadsheets that run formulas: a text that begins with one of `= + - @`, a tab or
/// a carriage return has a `'` before it. Numbers stay as they are.
std::string spreadsheet_safe(std::string_view csv);

}  // namespace pulson::text
