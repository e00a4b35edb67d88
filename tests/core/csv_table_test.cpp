#include "core/csv_table.hpp"

#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace pulson::text {
namespace {

using Strings = std::vector<std::string>;

/// The cells of a table by RFC 4180 and nothing else, in rows.
std::vector<Strings> cells_of(const std::string& csv) {
  std::vector<Strings> rows;
  std::string cell;
  bool inside = false, begins_row = true;
  Strings row;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    const char c = csv[i];
    if (c == '"' && inside && i + 1 < csv.size() && csv[i + 1] == '"') {
      cell += csv[++i];
    } else if (c == '"') {
      inside = !inside;
    } else if (!inside && (c == ',' || c == '\n')) {
      row.push_back(cell);
      cell.clear();
      if (c == '\n') {
        rows.push_back(row);
        row.clear();
      }
    } else {
      cell += c;
    }
    begins_row = c == '\n' && !inside;
  }
  EXPECT_TRUE(begins_row) << "the last row has no end";
  return rows;
}

const Strings kHostile = {"a,b",      "a\"b", "\"",   "\"=1", "a\nb",  "a\r\nb", "a\rb",    " a", "a ", "\ta",
                          "a;b",      "#3",   "id=x", "007",  "NA",    "",       "   ",     "=1", "+1", "-1",
                          "@x",       "'",    "//x",  "é",    "a\\nb", "sep=;",  "\"\"",    ",",  "\n", "-",
                          "=\"a\"&b", "x\"",  "1e5",  "nan",  "a\tb",  "\r",     "a\n\"\nb"};

TEST(CsvTable, TextsAndWordsReadBackExactly) {
  CsvTable table;
  for (const std::string& text : kHostile) table.text(text);
  table.end_row();
  for (const std::string& text : kHostile) table.word(text);
  table.end_row();
  const std::vector<Strings> rows = cells_of(std::move(table).take());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0], kHostile);
  EXPECT_EQ(rows[1], kHostile);
}

TEST(CsvTable, HarmlessWordsAndNumbersStandWithoutQuotes) {
  CsvTable table{"specimen", "x", "beta"};
  table.word("a_b-c.d").numbers(1.5, -0.1, 1e300).numbers(3, std::uint64_t{18446744073709551615U}, -7);
  table.text("a").missing().empty().cells("1,2").end_row();
  EXPECT_EQ(std::move(table).take(),
            "specimen,x,beta\na_b-c.d,1.5,-0.1,1e+300,3,18446744073709551615,-7,\"a\",NA,,1,2\n");
}

TEST(CsvTable, NumbersHaveTheFewestDigitsAndWhatIsNotFiniteIsNA) {
  Eigen::Vector3d numbers(0.1 + 0.2, std::numeric_limits<double>::quiet_NaN(), -2.2250738585072014e-308);
  CsvTable table;
  table.numbers(numbers).number(std::numeric_limits<double>::infinity()).end_row();
  EXPECT_EQ(std::move(table).take(), "0.30000000000000004,NA,-2.2250738585072014e-308,NA\n");
}

TEST(CsvTable, BytesThatAreNotUtf8AreReadAsWindows1252) {
  CsvTable table;
  table.text("gr\xFCn").word("\xE9").end_row();
  EXPECT_EQ(std::move(table).take(), "\"grün\",é\n");
}

TEST(SpreadsheetSafe, PutsAnApostropheBeforeFormulasAlone) {
  CsvTable table;
  for (const std::string& text : kHostile) table.text(text);
  table.end_row();
  for (const std::string& text : kHostile) table.word(text);
  table.numbers(-1.5, -3).missing().number(-std::numeric_limits<double>::infinity()).end_row();
  const std::vector<Strings> rows = cells_of(spreadsheet_safe(std::move(table).take()));
  Strings expected;
  for (const std::string& text : kHostile) {
    const bool is_formula = !text.empty() && std::string("=+-@\t\r").find(text.front()) != std::string::npos;
    expected.push_back(is_formula ? "'" + text : text);
  }
  EXPECT_EQ(rows[0], expected);
  expected.insert(expected.end(), {"-1.5", "-3", "NA", "NA"});
  EXPECT_EQ(rows[1], expected);
}

}  // namespace
}  // namespace pulson::text
