#include "columns.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

using formats::CsvRecord;

struct Address {
  std::string file, column;
};

Address parse_address(const std::string& text, const std::string& option) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.size())
    throw InputError(fmt::format("{} is '{}'; it must be FILE.csv:COLUMN", option, text));
  return {text.substr(0, colon), text.substr(colon + 1)};
}

std::size_t find_column(const formats::CsvRecord& header, const Address& address) {
  const auto& names = header.fields;
  auto found = std::find(names.begin(), names.end(), address.column);
  if (found == names.end())
    found = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
      return formats::plain_name(name) == formats::plain_name(address.column);
    });
  if (found == names.end())
    throw InputError(
        fmt::format("{}: there is no column '{}'; there are {}", address.file, address.column, fmt::join(names, ", ")));
  return static_cast<std::size_t>(found - names.begin());
}

const std::string& field(const std::string& file, const formats::CsvRecord& row, std::size_t column) {
  if (column >= row.fields.size())
    io::fail(file, row.line, fmt::format("has {} fields, fewer than the header", row.fields.size()));
  return row.name(column);
}

// The row of each specimen, by a column that holds all their names; none where there is no such column.
std::vector<std::size_t> rows_by_name(const std::vector<formats::CsvRecord>& rows,
                                      const std::vector<Landmarks>& shapes) {
  std::set<std::string> names;
  for (const Landmarks& shape : shapes) names.insert(shape.name);
  if (names.size() < shapes.size() || names.contains("")) return {};
  for (std::size_t column = 0; column < rows.front().fields.size(); ++column) {
    std::map<std::string, std::size_t> places;
    bool unique = true;
    for (std::size_t r = 0; r < rows.size() && unique; ++r)
      if (column < rows[r].fields.size()) unique = places.emplace(rows[r].name(column), r).second;
    if (!unique || !std::all_of(names.begin(), names.end(), [&](const auto& name) { return places.contains(name); }))
      continue;
    std::vector<std::size_t> chosen;
    for (const Landmarks& shape : shapes) chosen.push_back(places.at(shape.name));
    return chosen;
  }
  return {};
}

}  // namespace

std::vector<std::string> column_of_table(const std::string& text, const std::vector<Landmarks>& shapes,
                                         const std::string& option) {
  const Address address = parse_address(text, option);
  const std::string contents = io::read_text_file(address.file);
  std::vector<formats::CsvRecord> rows = formats::csv_records(address.file, contents);
  if (rows.size() < 2) throw InputError(fmt::format("{}: there are no rows below a header", address.file));
  const std::size_t column = find_column(rows.front(), address);
  rows.erase(rows.begin());
  std::vector<std::size_t> chosen = rows_by_name(rows, shapes);
  if (chosen.empty()) {
    if (rows.size() != shapes.size())
      throw InputError(fmt::format("{}: there are {} rows for {} shapes, and no column holds the names of all shapes",
                                   address.file, rows.size(), shapes.size()));
    for (std::size_t r = 0; r < rows.size(); ++r) chosen.push_back(r);
  }
  std::vector<std::string> values;
  for (const std::size_t r : chosen) values.push_back(field(address.file, rows[r], column));
  return values;
}

Eigen::VectorXd numbers_of_table(const std::string& address, const std::vector<Landmarks>& shapes,
                                 const std::string& option) {
  const std::vector<std::string> texts = column_of_table(address, shapes, option);
  Eigen::VectorXd numbers(std::ssize(texts));
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string_view text = io::trim(texts[i]);
    if (io::is_missing(text))
      numbers[static_cast<Eigen::Index>(i)] = io::kMissing;
    else if (io::is_number(text))
      numbers[static_cast<Eigen::Index>(i)] = parse_number(std::string(text), option);
    else
      throw InputError(fmt::format("{} {}: {} for specimen '{}' is not a number", option, address,
                                   io::in_quotes(texts[i]), shapes[i].name));
  }
  return numbers;
}

std::vector<std::string> groups_of(const std::string& address, const std::vector<Landmarks>& shapes) {
  if (address.find(':') != std::string::npos) {
    std::vector<std::string> groups = column_of_table(address, shapes, "--groups");
    for (std::string& name : groups)
      if (io::is_missing(io::trim(name))) name.clear();
    return groups;
  }
  std::vector<std::string> groups;
  std::set<std::string> known;
  for (const Landmarks& shape : shapes) {
    groups.emplace_back();
    for (const auto& [name, value] : shape.properties) {
      known.insert(name);
      if (io::to_lower(name) == io::to_lower(address)) groups.back() = value;
    }
  }
  if (std::all_of(groups.begin(), groups.end(), [](const std::string& name) { return name.empty(); }))
    throw InputError(fmt::format(
        "--groups is '{}'; it must be FILE.csv:COLUMN{}", address,
        known.empty() ? std::string() : fmt::format(" or a comment of the shapes' file: {}", fmt::join(known, ", "))));
  return groups;
}

}  // namespace pulson
