// Tables with a shape per line whose columns count the coordinates: `ProcCoord1, ProcCoord2, ...` of MorphoJ, `V1, V2,
// ...` and `X1, X2, ...` of R, or numbers alone.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "formats/text/text_lines.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

constexpr std::size_t kFewestCoordinates = 4;  // fewer are those of one landmark

/// What stands before the number of a coordinate, plain.
bool counts_coordinates(const std::string& plain) {
  constexpr std::array<std::string_view, 7> kPrefixes = {"proccoord",  "rawcoord", "coord", "coords",
                                                         "coordinate", "v",        "x"};
  return std::find(kPrefixes.begin(), kPrefixes.end(), plain) != kPrefixes.end();
}

/// `y1` beside `x1`
bool names_y(const CsvRecord& header) {
  return std::any_of(header.fields.begin(), header.fields.end(),
                     [](const std::string& name) { return plain_name(name) == "y1"; });
}

struct NumberedColumns {
  std::size_t begin = 0;
  std::size_t count = 0;
};

/// The run of columns `V1`, `V2`, ... from 1 on; none where they are too few.
NumberedColumns find_numbered(const CsvRecord& header) {
  for (std::size_t begin = 0; begin < header.fields.size(); ++begin) {
    const std::string first = plain_name(header.fields[begin]);
    if (!first.ends_with('1') || !counts_coordinates(first.substr(0, first.size() - 1))) continue;
    const std::string prefix = first.substr(0, first.size() - 1);
    if (prefix == "x" && names_y(header)) continue;
    std::size_t end = begin + 1;
    while (end < header.fields.size() && plain_name(header.fields[end]) == prefix + std::to_string(end - begin + 1))
      ++end;
    if (end - begin >= kFewestCoordinates) return {begin, end - begin};
  }
  return {};
}

/// Whether the coordinates of each line have their centroid at 0 if every `dimension`th is of one axis.
bool are_centred(const std::vector<CsvRecord>& records, const NumberedColumns& columns, std::size_t dimension) {
  constexpr double kZero = 1e-3;  // of the mean size of a coordinate: those of MorphoJ and R have 6 digits or more
  for (std::size_t r = 1; r < records.size(); ++r) {
    std::array<double, 3> sums{};
    double size = 0;
    for (std::size_t i = 0; i < columns.count; ++i) {
      const std::string& field = records[r].fields[columns.begin + i];
      if (!text::is_number(field)) return false;
      const double value = parse_number(field, "");
      sums[i % dimension] += value;
      size += std::abs(value);
    }
    if (std::any_of(sums.begin(), sums.end(), [&](double sum) { return std::abs(sum) > kZero * size; })) return false;
  }
  return true;
}

/// 2 or 3. @throws InputError where both are possible, or neither is
std::size_t dimension_of(const std::string& path, const std::vector<CsvRecord>& records, const NumberedColumns& columns,
                         std::size_t given) {
  const std::size_t line = records.front().line;
  const std::string what = fmt::format("{} coordinates in the columns {} to {}", columns.count,
                                       text::in_quotes(records.front().fields[columns.begin]),
                                       text::in_quotes(records.front().fields[columns.begin + columns.count - 1]));
  const std::size_t needed = given > 0 ? given : columns.count % 2 == 0 ? 2 : 3;
  if (columns.count % needed != 0)
    text::fail(
        path, line,
        fmt::format("{}, which landmarks in {} cannot have", what, given > 0 ? fmt::format("{}D", given) : "2D or 3D"));
  constexpr std::size_t kOneReading = 6;  // of 6, two landmarks in 3D would be no shape
  if (given > 0 || columns.count % 6 != 0 || columns.count == kOneReading) return needed;
  const bool may_be_plane = are_centred(records, columns, 2), may_be_space = are_centred(records, columns, 3);
  if (may_be_plane != may_be_space) return may_be_plane ? 2 : 3;
  text::fail(path, line,
             fmt::format("{} may be {} landmarks in 2D or {} in 3D; `dimension = 2` or `dimension = 3` says which",
                         what, columns.count / 2, columns.count / 3));
}

}  // namespace

bool numbers_coordinates(const CsvRecord& header) { return is_header(header) && find_numbered(header).count > 0; }

std::vector<std::string> name_numbered_coordinates(const std::string& path, std::vector<CsvRecord>& records,
                                                   int dimension) {
  if (records.empty() || !numbers_coordinates(records.front())) return {};
  require_equal_lengths(path, records);
  const NumberedColumns columns = find_numbered(records.front());
  const std::size_t d = dimension_of(path, records, columns, static_cast<std::size_t>(dimension));
  for (std::size_t i = 0; i < columns.count; ++i)
    records.front().fields[columns.begin + i] = fmt::format("{}{}", text::kAxisLetters[i % d], i / d + 1);
  if (columns.count % 6 != 0 || dimension > 0) return {};
  return {fmt::format("{}: {} coordinates per line, read as {} in {}D", path, columns.count,
                      text::counted(columns.count / d, "landmark"), d)};
}

namespace {

/// `ID`, `specimen` and their like.
bool names_things(const std::string& name) {
  const std::optional<ColumnMeaning> meaning = meaning_of(name);
  return meaning && (meaning->role == ColumnRole::kLabel || meaning->role == ColumnRole::kSpecimen);
}

}  // namespace

void name_numeric_header(std::vector<CsvRecord>& records) {
  if (records.size() < 2) return;
  std::vector<std::string>& names = records.front().fields;
  const std::size_t fewest = names.front().empty() ? 2 : kFewestCoordinates;
  if (names.size() < fewest + 1 || (!names.front().empty() && !names_things(names.front()))) return;
  const std::optional<std::size_t> first = parse_count(names[1]);
  if (!first || *first > 1) return;
  for (std::size_t i = 1; i < names.size(); ++i)
    if (names[i] != std::to_string(*first + i - 1)) return;
  const auto is_row = [&](const CsvRecord& record) {
    return record.fields.size() == names.size() && !record.fields.front().empty();
  };
  if (!std::all_of(records.begin() + 1, records.end(), is_row)) return;
  for (std::size_t i = 1; i < names.size(); ++i) names[i] = fmt::format("V{}", i);
}

void drop_count_line(std::vector<CsvRecord>& records) {
  if (records.size() < 3 || records[0].fields.size() != 1 || records[1].fields.size() < 2) return;
  if (is_header(records[1]) && parse_count(records[0].fields.front()) == records.size() - 2)
    records.erase(records.begin());
}

namespace {

/// `Mean`, `SD` and their like in one of the first two columns, as ImageJ summarises its results.
bool is_summary(const CsvRecord& record, std::initializer_list<std::string_view> names) {
  for (std::size_t i = 0; i < std::min<std::size_t>(2, record.fields.size()); ++i)
    if (std::find(names.begin(), names.end(), text::to_lower(record.fields[i])) != names.end()) return true;
  return false;
}

}  // namespace

std::vector<std::string> drop_summary_rows(const std::string& path, std::vector<CsvRecord>& records) {
  if (records.size() < 2 || !is_header(records.front())) return {};
  std::size_t begin = records.size();
  bool has_mean = false, has_deviation = false;
  while (begin > 1 && is_summary(records[begin - 1], {"mean", "average", "sd", "std", "stddev", "std dev", "min", "max",
                                                      "median", "sum"})) {
    --begin;
    has_mean |= is_summary(records[begin], {"mean", "average"});
    has_deviation |= is_summary(records[begin], {"sd", "std", "stddev", "std dev", "min", "max"});
  }
  if (!has_mean || !has_deviation) return {};
  const std::string note =
      fmt::format("{}:{}: {} from here on, such as {}, are summaries and no landmarks", path, records[begin].line,
                  text::counted(records.size() - begin, "line"),
                  text::in_quotes(is_summary({0, {records[begin].fields.front()}}, {"mean", "sd", "min", "max"})
                                      ? records[begin].fields.front()
                                      : records[begin].fields[1]));
  records.resize(begin);
  return {note};
}

}  // namespace pulson::formats
