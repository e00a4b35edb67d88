#include "csv_columns.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_layouts.hpp"

namespace pulson::io {
namespace {

constexpr std::string_view kRightHeader =
    "a landmark table has columns x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds "
    "several shapes";

std::string list_fields(const CsvRecord& record) {
  constexpr std::size_t kMost = 6;
  std::string list;
  for (std::size_t i = 0; i < std::min(kMost, record.fields.size()); ++i)
    list += (i > 0 ? ", " : "") + in_quotes(record.fields[i]);
  return list + (record.fields.size() > kMost ? ", ..." : "");
}

/// Columns that name the axes all together, in the order x, y, z.
struct NamedAxes {
  std::vector<std::string_view> names;  ///< plain
  std::string_view axes;                ///< where they point
};

const NamedAxes* find_named_axes(const CsvRecord& header, std::vector<std::size_t>& columns) {
  static const std::array<NamedAxes, 4> kNamedAxes = {{
      {{"l", "p", "s"}, "LPS"},
      {{"r", "a", "s"}, "RAS"},
      {{"axis2", "axis1", "axis0"}, ""},  // napari counts rows first
      {{"axis1", "axis0"}, ""},
  }};
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < header.fields.size(); ++i) places.try_emplace(plain_name(header.fields[i]), i);
  for (const NamedAxes& named : kNamedAxes) {
    columns.clear();
    for (const std::string_view name : named.names)
      if (const auto found = places.find(std::string(name)); found != places.end()) columns.push_back(found->second);
    if (columns.size() == named.names.size()) return &named;
  }
  columns.clear();
  return nullptr;
}

void require_one(const std::string& path, const CsvRecord& header, const std::vector<RankedColumn>& columns) {
  if (columns.size() < 2 || columns[0].rank != columns[1].rank) return;
  fail(path, header.line,
       fmt::format("the columns {} and {} mean the same; give only one", in_quotes(header.fields[columns[0].column]),
                   in_quotes(header.fields[columns[1].column])));
}

/// The units of x, which those of the other axes have to be.
std::string units_of(const std::string& path, const CsvRecord& header, const std::vector<std::size_t>& columns) {
  const std::string& first = header.fields[columns.front()];
  std::string unit = meaning_of(first)->unit;
  for (const std::size_t column : columns)
    if (meaning_of(header.fields[column])->unit != unit)
      fail(path, header.line,
           fmt::format("the columns {} and {} are not in the same units", in_quotes(first),
                       in_quotes(header.fields[column])));
  return unit;
}

bool is_worded(const CsvRecord& header, std::size_t column) { return meaning_of(header.fields[column])->rank > 1; }

void find_coordinates(const std::string& path, const CsvRecord& header, CsvColumns& result) {
  std::vector<std::size_t>& found = result.coordinates;
  for (const ColumnRole role : {ColumnRole::kX, ColumnRole::kY, ColumnRole::kZ}) {
    const std::vector<RankedColumn> columns = find_columns(header, role);
    // `Z-pos` of ImageJ's cell counter is the number of a slice beside its X and Y
    const bool is_other_z = role == ColumnRole::kZ && !columns.empty() && found.size() == 2 &&
                            is_worded(header, columns.front().column) != is_worded(header, found.front());
    if (columns.empty() || is_other_z) continue;
    if (found.size() != static_cast<std::size_t>(role))
      fail(path, header.line,
           fmt::format("there is a column {} but none for {}; {}", in_quotes(header.fields[columns.front().column]),
                       "xyz"[found.size()], kRightHeader));
    require_one(path, header, columns);
    found.push_back(columns.front().column);
  }
  if (!found.empty()) {
    result.units = units_of(path, header, found);
    return;
  }
  const NamedAxes* const named = find_named_axes(header, found);
  if (named == nullptr)
    fail(path, header.line, fmt::format("no coordinates in the columns {}; {}", list_fields(header), kRightHeader));
  result.axes = named->axes;
  if (result.axes.empty())
    result.notes.push_back(fmt::format("the columns {} are read as {}, as napari counts rows first",
                                       found.size() == 2 ? "axis-0, axis-1" : "axis-0, axis-1, axis-2",
                                       found.size() == 2 ? "y, x" : "z, y, x"));
}

bool is_used(const CsvColumns& columns, std::size_t column) {
  const auto has = [&](const std::vector<std::size_t>& list) {
    return std::find(list.begin(), list.end(), column) != list.end();
  };
  return has(columns.coordinates) || has(columns.specimen) || column == columns.label || column == columns.group ||
         column == columns.image || column == columns.defined;
}

/// Whether a line is a name and two or three coordinates.
bool is_named_point(const CsvRecord& record) {
  const auto& fields = record.fields;
  if (fields.size() < 3 || fields.size() > 4 || is_missing(fields.front()) || is_number(fields.front())) return false;
  return std::all_of(fields.begin() + 1, fields.end(), is_number_or_missing);
}

}  // namespace

std::vector<RankedColumn> find_columns(const CsvRecord& header, ColumnRole role) {
  std::vector<RankedColumn> columns;
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (const auto meaning = meaning_of(header.fields[i]); meaning && meaning->role == role)
      columns.push_back({i, meaning->rank});
  std::stable_sort(columns.begin(), columns.end(), [](const auto& a, const auto& b) { return a.rank < b.rank; });
  return columns;
}

std::optional<std::size_t> find_column(const CsvRecord& header, ColumnRole role) {
  const std::vector<RankedColumn> columns = find_columns(header, role);
  return columns.empty() ? std::nullopt : std::optional(columns.front().column);
}

bool is_number_or_missing(const std::string& field) { return is_missing(field) || is_number(field); }

bool holds_named_points(const std::vector<CsvRecord>& records) {
  const auto holds_a_number = [](const CsvRecord& record) {
    return std::any_of(record.fields.begin(), record.fields.end(), is_number);
  };
  return std::all_of(records.begin(), records.end(), is_named_point) &&
         std::any_of(records.begin(), records.end(), holds_a_number);
}

bool holds_numbers(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(), is_number_or_missing);
}

bool holds_only_marks(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(),
                     [](const std::string& field) { return is_missing(field); });
}

bool is_header(const CsvRecord& record) {
  const auto& fields = record.fields;
  return std::none_of(fields.begin(), fields.end(), [](const std::string& field) { return is_number(field); }) &&
         !holds_only_marks(record);
}

bool names_coordinates(const CsvRecord& header) {
  const auto is_axis = [](const std::string& name) {
    const auto meaning = meaning_of(name);
    return meaning && is_coordinate(meaning->role);
  };
  std::vector<std::size_t> columns;
  return std::any_of(header.fields.begin(), header.fields.end(), is_axis) ||
         find_named_axes(header, columns) != nullptr;
}

bool names_plain_coordinates(const CsvRecord& header) {
  return std::any_of(header.fields.begin(), header.fields.end(), [](const std::string& name) {
    const auto meaning = meaning_of(name);
    return meaning && is_coordinate(meaning->role) && meaning->rank == 0;
  });
}

CsvColumns columns_of_header(const std::string& path, const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  CsvColumns result;
  find_coordinates(path, header, result);
  for (const ColumnRole role : {ColumnRole::kGroup, ColumnRole::kDefined})
    require_one(path, header, find_columns(header, role));
  result.group = find_column(header, ColumnRole::kGroup);
  result.defined = find_column(header, ColumnRole::kDefined);
  require_equal_lengths(path, records);
  choose_names(path, records, result);
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const auto meaning = meaning_of(header.fields[i]);
    const bool is_index = meaning && meaning->role == ColumnRole::kLabel && meaning->rank == kIndexRank;
    const bool is_unnamed_first = i == 0 && header.fields[i].empty();
    if (!is_index && !is_unnamed_first && !is_used(result, i)) result.unused.push_back(header.fields[i]);
  }
  return result;
}

CsvColumns columns_of_named_points(const CsvRecord& first) {
  CsvColumns columns;
  columns.label = 0;
  for (std::size_t i = 1; i < first.fields.size(); ++i) columns.coordinates.push_back(i);
  return columns;
}

CsvColumns columns_without_header(const std::string& path, const CsvRecord& first) {
  for (const std::string& field : first.fields)
    if (!is_number(field) && !is_missing(field))
      fail(path, first.line,
           in_quotes(field) + " is not a number; a table with more than coordinates needs a header such as label,x,y");
  CsvColumns columns;
  for (std::size_t i = 0; i < first.fields.size(); ++i) columns.coordinates.push_back(i);
  if (columns.coordinates.size() > 3)
    fail(
        path, first.line,
        fmt::format("{} columns without a header; a table without one has the columns x[,y[,z]], one landmark per line",
                    first.fields.size()));
  return columns;
}

}  // namespace pulson::io
