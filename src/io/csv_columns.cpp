#include "csv_columns.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "text.hpp"

namespace pulson::io {
namespace {

enum class Role { kX, kY, kZ, kLabel, kGroup, kSpecimen };

struct NamedRole {
  std::string_view name;  // lower case
  Role role;
};

constexpr std::array<NamedRole, 17> kNamedRoles = {{
    {"x", Role::kX},
    {"y", Role::kY},
    {"z", Role::kZ},
    {"pos1", Role::kX},
    {"pos2", Role::kY},
    {"pos3", Role::kZ},
    {"label", Role::kLabel},
    {"landmark", Role::kLabel},
    {"name", Role::kLabel},
    {"id", Role::kLabel},
    {"coord_id", Role::kLabel},
    {"landmark_id", Role::kLabel},
    {"group", Role::kGroup},
    {"outline", Role::kGroup},
    {"specimen", Role::kSpecimen},
    {"specimen_id", Role::kSpecimen},
    {"shape", Role::kSpecimen},
}};

constexpr std::string_view kRightHeader =
    "a landmark table has columns x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds "
    "several shapes";

std::optional<Role> role_of(std::string_view name) {
  const std::string lower = to_lower(name);
  const auto* const found =
      std::find_if(kNamedRoles.begin(), kNamedRoles.end(), [&](const NamedRole& named) { return named.name == lower; });
  return found == kNamedRoles.end() ? std::nullopt : std::optional(found->role);
}

bool is_coordinate(Role role) { return role <= Role::kZ; }

std::string list_fields(const CsvRecord& record) {
  constexpr std::size_t kMost = 6;
  std::string list;
  for (std::size_t i = 0; i < std::min(kMost, record.fields.size()); ++i)
    list += (i > 0 ? ", " : "") + in_quotes(record.fields[i]);
  return list + (record.fields.size() > kMost ? ", ..." : "");
}

using RoleColumns = std::map<Role, std::size_t>;

std::vector<std::size_t> coordinate_columns(const std::string& path, const CsvRecord& header,
                                            const RoleColumns& columns) {
  std::vector<std::size_t> found;
  for (const Role role : {Role::kX, Role::kY, Role::kZ}) {
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

void add_role(const std::string& path, const CsvRecord& header, Role role, std::size_t column, RoleColumns& columns) {
  const auto [other, is_new] = columns.try_emplace(role, column);
  if (is_new) return;
  const char* const advice = role == Role::kLabel ? "; call the one that names the specimen 'specimen'" : "";
  fail(path, header.line,
       fmt::format("the columns {} and {} mean the same, one of them is needed{}",
                   in_quotes(header.fields[other->second]), in_quotes(header.fields[column]), advice));
}

std::optional<std::size_t> find_role(const RoleColumns& columns, Role role) {
  const auto found = columns.find(role);
  return found == columns.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

bool holds_numbers(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(),
                     [](const std::string& field) { return is_number(field) || is_missing(field); });
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
    const std::optional<Role> role = role_of(field);
    return role && is_coordinate(*role);
  });
}

CsvColumns columns_of_header(const std::string& path, const CsvRecord& header) {
  RoleColumns columns;
  CsvColumns result;
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const bool is_index = i == 0 && header.fields[i].empty();
    if (const std::optional<Role> role = role_of(header.fields[i]))
      add_role(path, header, *role, i, columns);
    else if (!is_index)
      result.unused.push_back(header.fields[i]);
  }
  if (header.fields.front().empty()) columns.try_emplace(Role::kLabel, 0);
  result.coordinates = coordinate_columns(path, header, columns);
  result.label = find_role(columns, Role::kLabel);
  result.group = find_role(columns, Role::kGroup);
  result.specimen = find_role(columns, Role::kSpecimen);
  return result;
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
