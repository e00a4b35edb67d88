#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "csv_layouts.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::io {
namespace {

struct NamedRole {
  std::string_view key;  ///< of ReadOptions::columns
  ColumnRole role;
  std::string_view name;  ///< of the column that has the role before all others
};

constexpr std::array<NamedRole, 6> kRoles = {{{"x", ColumnRole::kX, "x"},
                                              {"y", ColumnRole::kY, "y"},
                                              {"z", ColumnRole::kZ, "z"},
                                              {"name", ColumnRole::kLabel, "landmark"},
                                              {"specimen", ColumnRole::kSpecimen, "specimen"},
                                              {"group", ColumnRole::kGroup, "group"}}};

const NamedRole& role_named(const std::string& key) {
  const auto* const found =
      std::find_if(kRoles.begin(), kRoles.end(), [&](const NamedRole& role) { return role.key == key; });
  if (found != kRoles.end()) return *found;
  throw InputError(fmt::format("'{}' is not the name of a kind of column; valid: x, y, z, name, specimen, group", key));
}

std::string list_columns(const CsvRecord& header) {
  constexpr std::size_t kMost = 20;
  const std::size_t shown = std::min(kMost, header.fields.size());
  std::string list;
  for (std::size_t i = 0; i < shown; ++i) list += (i > 0 ? ", " : "") + in_quotes(header.fields[i]);
  return shown < header.fields.size() ? fmt::format("{}, ... ({} in all)", list, header.fields.size()) : list;
}

/// The column of this name or, where there is none, the only one of it but for case, blanks and `_ . -`.
std::size_t find_by_name(const std::string& path, const CsvRecord& header, const std::string& name) {
  const auto& fields = header.fields;
  const auto exact = std::find(fields.begin(), fields.end(), name);
  if (exact != fields.end()) return static_cast<std::size_t>(exact - fields.begin());
  std::vector<std::size_t> alike;
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (plain_name(fields[i]) == plain_name(name)) alike.push_back(i);
  if (alike.size() == 1) return alike.front();
  const std::string near = nearest_name(name, fields);
  fail(path, header.line,
       fmt::format("no column {}{}; the columns are {}", in_quotes(name),
                   near.empty() ? "" : ", did you mean " + in_quotes(near) + "?", list_columns(header)));
}

/// Whether a column would compete with one that is chosen for the role. Images may stand beside specimens.
bool competes(const std::string& name, ColumnRole role) {
  const std::optional<ColumnMeaning> meaning = meaning_of(name);
  return meaning && meaning->role == role && (role != ColumnRole::kSpecimen || meaning->rank < kImageRank);
}

}  // namespace

void name_columns(const std::string& path, CsvRecord& header, const std::map<std::string, std::string>& columns) {
  if (!is_header(header))
    fail(path, header.line, "the first line names no columns: " + list_columns(header) + "; a header is needed");
  std::vector<std::pair<std::size_t, const NamedRole*>> chosen;
  for (const auto& [key, name] : columns) {
    const std::size_t column = find_by_name(path, header, name);
    for (const auto& other : chosen)
      if (other.first == column)
        fail(path, header.line,
             fmt::format("the column {} cannot hold both {} and {}", in_quotes(name), other.second->key, key));
    chosen.emplace_back(column, &role_named(key));
  }
  for (const auto& [column, role] : chosen)
    for (std::string& field : header.fields)
      if (competes(field, role->role)) field = fmt::format("({})", field);
  for (const auto& [column, role] : chosen) header.fields[column] = role->name;
}

bool is_one_column(const std::vector<CsvRecord>& records) {
  return std::all_of(records.begin(), records.end(), [](const CsvRecord& record) { return record.fields.size() == 1; });
}

LandmarkFile read_in_turn(const std::string& path, const std::vector<CsvRecord>& records, std::size_t dimension) {
  const std::size_t begin = is_header(records.front()) ? 1 : 0;
  const std::size_t count = records.size() - begin;
  if (count == 0 || count % dimension != 0)
    fail(path, records.back().line,
         fmt::format("{} in one column; with {} coordinates for each landmark a multiple of {} is needed",
                     counted(count, "number"), dimension, dimension));
  std::vector<double> coordinates;
  for (std::size_t i = begin; i < records.size(); ++i) {
    const std::size_t place = i - begin;
    coordinates.push_back(
        parse_coordinate(records[i].fields.front(),
                         {path, records[i].line, std::to_string(place / dimension + 1), "", place % dimension}));
  }
  LandmarkFile file;
  file.shapes.emplace_back().points = Points::Map(coordinates.data(), static_cast<Eigen::Index>(dimension),
                                                  static_cast<Eigen::Index>(count / dimension));
  return file;
}

}  // namespace pulson::io
