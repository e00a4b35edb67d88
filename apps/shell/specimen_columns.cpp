#include "specimen_columns.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "core/name_matching.hpp"
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
    text::fail(file, row.line, fmt::format("has {} fields, fewer than the header", row.fields.size()));
  return row.name(column);
}

NameList names_in_column(const Address& address, const std::vector<CsvRecord>& rows, std::size_t column) {
  NameList list{address.file, {}};
  for (const CsvRecord& row : rows) list.names.push_back(column < row.fields.size() ? row.name(column) : "");
  return list;
}

// What the header says of a column, the most telling first.
enum class Telling : unsigned char { kNames, kRowNames, kNothing };

// Of names of specimens or their pictures; without a name, as R and pandas number or name the rows.
Telling telling_of(const std::string& name) {
  if (name.empty()) return Telling::kRowNames;
  const std::optional<formats::ColumnMeaning> meaning = formats::meaning_of(name);
  const bool names =
      meaning && (meaning->role == formats::ColumnRole::kSpecimen ||
                  (meaning->role == formats::ColumnRole::kLabel && meaning->rank != formats::kIndexRank));
  return names ? Telling::kNames : Telling::kNothing;
}

// Whether it may name rows: texts, all different.
bool are_names(const NameList& column) {
  std::set<std::string_view> seen;
  return std::all_of(column.names.begin(), column.names.end(), [&](const std::string& name) {
    return !name.empty() && !text::is_number(name) && seen.insert(name).second;
  });
}

// Whether a shape has a name of its own, and not the one that its place in a file gives it.
bool is_named(const Landmarks& shape) {
  const std::size_t hash = shape.source.rfind('#');
  return !shape.name.empty() && (hash == std::string::npos || !shape.name.ends_with(shape.source.substr(hash)));
}

NameList names_of(const std::vector<Landmarks>& shapes, std::string Landmarks::*name) {
  const std::string file = shapes.front().source.substr(0, shapes.front().source.rfind('#'));
  const bool is_one_file = std::all_of(shapes.begin(), shapes.end(), [&](const Landmarks& shape) {
    return shape.source.substr(0, shape.source.rfind('#')) == file;
  });
  NameList list{is_one_file ? file : "the shapes", {}};
  for (const Landmarks& shape : shapes) list.names.push_back(shape.*name);
  return list;
}

// By which column rows belong to specimens.
struct RowNames {
  NameMatch match{};  ///< specimens to rows
  NameList specimens{}, rows{};
  std::string column{};

  // Names that are alike as they stand count for more.
  auto score() const { return std::tuple(match.plain, match.exact, match.matched()); }
};

class SpecimenRows {
 public:
  SpecimenRows(const Address& address, const std::vector<CsvRecord>& header_and_rows, std::size_t asked,
               const std::vector<Landmarks>& shapes)
      : address_(address),
        header_(header_and_rows.front()),
        rows_(header_and_rows.begin() + 1, header_and_rows.end()),
        asked_(asked),
        shapes_(shapes) {}

  std::vector<int> find(bool by_order, std::vector<std::string>& notes) const {
    if (by_order) return in_order();
    RowNames best;
    for (const Telling telling : {Telling::kNames, Telling::kRowNames, Telling::kNothing}) {
      best = best_column(telling);
      if (best.match.matched() == 0 && best.match.problem.empty()) continue;
      check(best);
      if (telling != Telling::kNames)
        notes.push_back(fmt::format("{}: rows belong to shapes by {}", address_.file,
                                    best.column.empty() ? "the first column, which has no name"
                                                        : "the column " + text::in_quotes(best.column)));
      break;
    }
    if (best.match.matched() == 0) return without_names();
    if (!best.match.note.empty()) notes.push_back(best.match.note);
    if (const std::size_t spare = rows_.size() - shapes_.size(); spare > 0)
      notes.push_back(fmt::format("{}: {} {} to no shape and {} not used", address_.file, text::counted(spare, "row"),
                                  spare == 1 ? "belongs" : "belong", spare == 1 ? "is" : "are"));
    return best.match.partners;
  }

 private:
  std::vector<int> in_order() const {
    if (rows_.size() != shapes_.size())
      throw InputError(fmt::format("{}: there are {} rows for {} shapes", address_.file, rows_.size(), shapes_.size()));
    std::vector<int> all(rows_.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  // Of columns that say nothing those of words: numbers may be ages.
  bool may_name_rows(std::size_t column, Telling telling) const {
    if (column == asked_ || telling_of(header_.fields[column]) != telling) return false;
    return telling != Telling::kNothing || are_names(names_in_column(address_, rows_, column));
  }

  RowNames best_column(Telling telling) const {
    RowNames best;
    for (std::size_t column = 0; column < header_.fields.size(); ++column) {
      if (!may_name_rows(column, telling)) continue;
      for (std::string Landmarks::*const name : {&Landmarks::name, &Landmarks::image}) {
        RowNames found{{}, names_of(shapes_, name), names_in_column(address_, rows_, column), header_.fields[column]};
        found.match = match_names(found.specimens, found.rows, NameKind::kSpecimens);
        const bool is_better = found.score() > best.score();
        if (found.score() == best.score() && found.match.matched() > 0 && found.match.partners != best.match.partners)
          best.match.problem = fmt::format("{}: the columns {} and {} both hold names of the shapes, in other rows",
                                           address_.file, text::in_quotes(best.column), text::in_quotes(found.column));
        if (is_better || (best.specimens.names.empty() && !found.match.problem.empty())) best = std::move(found);
      }
    }
    return best;
  }

  // Where no name of a shape is in the table.
  std::vector<int> without_names() const {
    bool has_names = std::any_of(shapes_.begin(), shapes_.end(), is_named);
    for (std::size_t column = 0; column < header_.fields.size(); ++column)
      has_names = has_names || (column != asked_ && are_names(names_in_column(address_, rows_, column)));
    if (!has_names) return in_order();
    throw InputError(fmt::format("{}: no column holds the names of the shapes, {} to {}{}", address_.file,
                                 quoted_line(shapes_.front().name), quoted_line(shapes_.back().name), or_by_order()));
  }

  void check(const RowNames& best) const {
    const std::vector<int> lonely = best.match.unmatched();
    if (lonely.empty() && best.match.problem.empty()) return;
    const auto names = [](const NameList& list, const std::vector<int>& places) {
      std::vector<std::string> chosen;
      for (const int i : places) chosen.push_back(list.names[static_cast<std::size_t>(i)]);
      return listed_names(chosen);
    };
    std::string text = best.match.problem;
    if (!lonely.empty()) {
      const std::vector<int> spare = best.match.spare(static_cast<int>(rows_.size()));
      text += fmt::format(
          "{}{}: {} of {} shapes {} no row of {} own in the column {}: {}{}", text.empty() ? "" : "; ", address_.file,
          lonely.size(), shapes_.size(), lonely.size() == 1 ? "has" : "have", lonely.size() == 1 ? "its" : "their",
          text::in_quotes(best.column), names(best.specimens, lonely),
          spare.empty() || spare.size() > lonely.size() ? fmt::format(" ({} rows belong to no shape)", spare.size())
                                                        : "; rows of no shape: " + names(best.rows, spare));
    }
    throw InputError(text + or_by_order());
  }

  std::string or_by_order() const {
    return rows_.size() == shapes_.size() ? "; `by_order` takes the rows in the order of the shapes" : "";
  }

  const Address& address_;
  const CsvRecord& header_;
  std::vector<CsvRecord> rows_;
  std::size_t asked_;
  const std::vector<Landmarks>& shapes_;
};

// R names the rows in a column for which its header has no field.
void name_rows(const std::string& file, std::vector<CsvRecord>& records) {
  CsvRecord& header = records.front();
  const auto is_longer = [&](const CsvRecord& row) { return row.fields.size() == header.fields.size() + 1; };
  if (std::all_of(records.begin() + 1, records.end(), is_longer)) {
    header.fields.insert(header.fields.begin(), "");
    for (auto& [column, text] : header.padded) ++column;
    return;
  }
  for (const CsvRecord& row : records)
    if (row.fields.size() > header.fields.size())
      text::fail(file, row.line,
                 fmt::format("has {} fields, more than the {} of the header", row.fields.size(), header.fields.size()));
}

// With a name for each column, and at least one row.
std::vector<CsvRecord> named_records(const std::string& file) {
  const std::string contents = text::read_text_file(file);
  std::vector<CsvRecord> records = formats::csv_records(file, contents);
  if (records.size() < 2) throw InputError(fmt::format("{}: there are no rows below a header", file));
  name_rows(file, records);
  return records;
}

}  // namespace

std::vector<std::string> column_of_table(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                         std::vector<std::string>& notes) {
  const Address address =
      table.column.empty() ? parse_address(table.address, table.option) : Address{table.address, table.column};
  const std::vector<CsvRecord> records = named_records(address.file);
  const std::size_t column = find_column(records.front(), address);
  std::vector<std::string> values;
  for (const int row : SpecimenRows(address, records, column, shapes).find(table.by_order, notes))
    values.push_back(field(address.file, records[static_cast<std::size_t>(row) + 1], column));
  return values;
}

Eigen::VectorXd numbers_of_table(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                 std::vector<std::string>& notes) {
  const std::vector<std::string> texts = column_of_table(table, shapes, notes);
  Eigen::VectorXd numbers(std::ssize(texts));
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string_view text = text::trim(texts[i]);
    if (text::is_missing(text))
      numbers[static_cast<Eigen::Index>(i)] = text::kMissing;
    else if (text::is_number(text))
      numbers[static_cast<Eigen::Index>(i)] = parse_number(std::string(text), table.option);
    else
      throw InputError(fmt::format("{} {}: {} for specimen '{}' is not a number", table.option, table.address,
                                   text::in_quotes(texts[i]), shapes[i].name));
  }
  return numbers;
}

std::vector<std::string> columns_in_table(const std::string& file) { return named_records(file).front().fields; }

bool has_name(const std::vector<std::string>& names, const std::string& name) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& known) {
    return known == name || formats::plain_name(known) == formats::plain_name(name);
  });
}

std::vector<std::string> properties_of(const std::vector<Landmarks>& shapes) {
  std::set<std::string> known;
  for (const Landmarks& shape : shapes)
    for (const auto& [name, value] : shape.properties) known.insert(name);
  return {known.begin(), known.end()};
}

std::vector<std::string> property_of(const std::vector<Landmarks>& shapes, const std::string& name) {
  std::vector<std::string> fields;
  for (const Landmarks& shape : shapes) {
    fields.emplace_back();
    for (const auto& [known, value] : shape.properties)
      if (text::to_lower(known) == text::to_lower(name)) fields.back() = value;
  }
  return fields;
}

std::vector<std::string> groups_of(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                   std::vector<std::string>& notes) {
  const std::string& address = table.address;
  if (address.find(':') != std::string::npos) {
    std::vector<std::string> groups = column_of_table(table, shapes, notes);
    for (std::string& name : groups)
      if (text::is_missing(text::trim(name))) name.clear();
    return groups;
  }
  std::vector<std::string> groups = property_of(shapes, address);
  const std::vector<std::string> known = properties_of(shapes);
  if (std::all_of(groups.begin(), groups.end(), [](const std::string& name) { return name.empty(); }))
    throw InputError(fmt::format(
        "--groups is '{}'; it must be FILE.csv:COLUMN{}", address,
        known.empty() ? std::string() : fmt::format(" or a comment of the shapes' file: {}", fmt::join(known, ", "))));
  return groups;
}

}  // namespace pulson
