#include "csv_columns.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "text.hpp"

namespace pulson::io {
namespace {

struct NamedRole {
  std::string_view name;  // lower case
  ColumnRole role;
};

constexpr std::array<NamedRole, 17> kNamedRoles = {{
    {"x", ColumnRole::kX},
    {"y", ColumnRole::kY},
    {"z", ColumnRole::kZ},
    {"pos1", ColumnRole::kX},
    {"pos2", ColumnRole::kY},
    {"pos3", ColumnRole::kZ},
    {"label", ColumnRole::kLabel},
    {"landmark", ColumnRole::kLabel},
    {"name", ColumnRole::kLabel},
    {"id", ColumnRole::kLabel},
    {"coord_id", ColumnRole::kLabel},
    {"landmark_id", ColumnRole::kLabel},
    {"group", ColumnRole::kGroup},
    {"outline", ColumnRole::kGroup},
    {"specimen", ColumnRole::kSpecimen},
    {"specimen_id", ColumnRole::kSpecimen},
    {"shape", ColumnRole::kSpecimen},
}};

constexpr std::string_view kRightHeader =
    "a landmark table has columns x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds "
    "several shapes";

bool is_coordinate(ColumnRole role) { return role <= ColumnRole::kZ; }

std::string list_fields(const CsvRecord& record) {
  constexpr std::size_t kMost = 6;
  std::string list;
  for (std::size_t i = 0; i < std::min(kMost, record.fields.size()); ++i)
    list += (i > 0 ? ", " : "") + in_quotes(record.fields[i]);
  return list + (record.fields.size() > kMost ? ", ..." : "");
}

using RoleColumns = std::map<ColumnRole, std::size_t>;

std::vector<std::size_t> coordinate_columns(const std::string& path, const CsvRecord& header,
                                            const RoleColumns& columns) {
  std::vector<std::size_t> found;
  for (const ColumnRole role : {ColumnRole::kX, ColumnRole::kY, ColumnRole::kZ}) {
    const auto column = columns.find(role);
    if (column == columns.end()) continue;
    if (found.size() != static_cast<std::size_t>(role))
      fail(path, header.line,
           fmt::format("there is a column {} but none for {}; {}", in_quotes(header.fields[column->second]),
                       "xyz"[found.size()], kRightHeader));
    found.push_back(column->second);
  }
  if (found.empty())
    fail(path, header.line, fmt::format("no coordinates in the columns {}; {}", list_fields(header), kRightHeader));
  return found;
}

void add_role(const std::string& path, const CsvRecord& header, ColumnRole role, std::size_t column,
              RoleColumns& columns) {
  const auto [other, is_new] = columns.try_emplace(role, column);
  if (is_new) return;
  const char* const advice = role == ColumnRole::kLabel ? "; call the one that names the specimen 'specimen'" : "";
  fail(path, header.line,
       fmt::format("the columns {} and {} mean the same, one of them is needed{}",
                   in_quotes(header.fields[other->second]), in_quotes(header.fields[column]), advice));
}

std::optional<std::size_t> find_role(const RoleColumns& columns, ColumnRole role) {
  const auto found = columns.find(role);
  return found == columns.end() ? std::nullopt : std::optional(found->second);
}

/// Whether a line is a name and two or three coordinates.
bool is_named_point(const CsvRecord& record) {
  const auto& fields = record.fields;
  if (fields.size() < 3 || fields.size() > 4 || is_missing(fields.front()) || is_number(fields.front())) return false;
  return std::all_of(fields.begin() + 1, fields.end(), is_number_or_missing);
}

}  // namespace

std::optional<ColumnRole> role_of(std::string_view name) {
  const std::string lower = to_lower(name);
  const auto* const found =
      std::find_if(kNamedRoles.begin(), kNamedRoles.end(), [&](const NamedRole& named) { return named.name == lower; });
  return found == kNamedRoles.end() ? std::nullopt : std::optional(found->role);
}

std::optional<std::size_t> find_column(const CsvRecord& header, ColumnRole role) {
  const auto& fields = header.fields;
  const auto found =
      std::find_if(fields.begin(), fields.end(), [&](const std::string& name) { return role_of(name) == role; });
  return found == fields.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - fields.begin()));
}

std::optional<std::size_t> axis_of_word(std::string_view word) {
  const std::string lower = to_lower(word);
  const std::size_t axis = std::string_view("xyz").find(lower.empty() ? '\0' : lower.front());
  if (axis == std::string_view::npos) return std::nullopt;
  std::string_view rest = std::string_view(lower).substr(1);
  rest.remove_prefix(std::min(rest.find_first_not_of("-_. "), rest.size()));
  for (const std::string_view ending : {"", "coordinates", "coordinate", "coords", "coord"})
    if (rest == ending) return axis;
  return std::nullopt;
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
  return std::any_of(header.fields.begin(), header.fields.end(), [](const std::string& field) {
    const std::optional<ColumnRole> role = role_of(field);
    return role && is_coordinate(*role);
  });
}

CsvColumns columns_of_header(const std::string& path, const CsvRecord& header) {
  RoleColumns columns;
  CsvColumns result;
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const bool is_index = i == 0 && header.fields[i].empty();
    if (const std::optional<ColumnRole> role = role_of(header.fields[i]))
      add_role(path, header, *role, i, columns);
    else if (!is_index)
      result.unused.push_back(header.fields[i]);
  }
  if (header.fields.front().empty()) columns.try_emplace(ColumnRole::kLabel, 0);
  result.coordinates = coordinate_columns(path, header, columns);
  result.label = find_role(columns, ColumnRole::kLabel);
  result.group = find_role(columns, ColumnRole::kGroup);
  result.specimen = find_role(columns, ColumnRole::kSpecimen);
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
