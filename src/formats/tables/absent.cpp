// Tables of structures that specimens do not have: the specimen, and the landmarks that it lacks.

#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/missing_marks.hpp"
#include "formats/tables/landmark_lookup.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

/// A cell of the table that names landmarks.
struct AbsentCell {
  std::size_t line;
  std::string text, column;
};

class AbsentTable {
 public:
  explicit AbsentTable(const std::string& address) : path_(address) {
    std::string columns;
    const std::size_t colon = address.rfind(':');
    if (colon != std::string::npos && !std::filesystem::exists(address)) {
      path_ = address.substr(0, colon);
      columns = address.substr(colon + 1);
    }
    records_ = csv_records(path_, text::read_text_file(path_));
    if (records_.size() < 2) throw InputError(path_ + ": there are no rows below a header");
    specimen_ = find_column(records_.front(), ColumnRole::kSpecimen).value_or(0);
    choose_columns(columns);
  }

  const std::string& path() const { return path_; }

  /// Those of all rows of a shape. @throws InputError where it has none
  std::vector<AbsentCell> cells_of(const Landmarks& shape) const {
    std::vector<AbsentCell> cells;
    bool is_listed = false;
    std::vector<std::string> names;
    for (auto row = records_.begin() + 1; row != records_.end(); ++row) {
      if (row->fields.size() <= specimen_) continue;
      names.push_back(row->name(specimen_));
      if (names.back() != shape.name) continue;
      is_listed = true;
      for (const std::size_t column : columns_)
        if (column < row->fields.size() && !text::is_missing(row->fields[column]))
          cells.push_back({row->line, row->fields[column], records_.front().fields[column]});
    }
    if (is_listed) return cells;
    const std::string near = nearest_name(shape.name, names);
    throw InputError(fmt::format("{}: no row is of {} ({}){}; each shape needs one, empty where it lacks nothing",
                                 path_, text::in_quotes(shape.name), shape.source,
                                 near.empty() ? "" : fmt::format(", did you mean {}?", text::in_quotes(near))));
  }

 private:
  void choose_columns(std::string_view names) {
    const CsvRecord& header = records_.front();
    for (std::size_t i = 0; i < header.fields.size() && names.empty(); ++i)
      if (i != specimen_) columns_.push_back(i);
    while (!names.empty()) {
      const std::size_t comma = std::min(names.find(','), names.size());
      const std::string name(text::trim(names.substr(0, comma)));
      const auto found = std::find(header.fields.begin(), header.fields.end(), name);
      if (found == header.fields.end())
        throw InputError(fmt::format("{}: there is no column {}; there are {}", path_, text::in_quotes(name),
                                     fmt::join(header.fields, ", ")));
      columns_.push_back(static_cast<std::size_t>(found - header.fields.begin()));
      names.remove_prefix(std::min(comma + 1, names.size()));
    }
  }

  std::string path_;
  std::vector<CsvRecord> records_;
  std::size_t specimen_ = 0;
  std::vector<std::size_t> columns_;
};

// One landmark that is named by all of a cell, or several with blanks between.
std::vector<int> landmarks_in(const AbsentTable& table, const AbsentCell& cell, const Landmarks& shape,
                              const LandmarkLookup& names) {
  if (const std::optional<int> whole = names.find(cell.text)) return {*whole};
  std::vector<int> found;
  for (const std::string_view word : text::split_words(cell.text)) {
    const std::optional<int> landmark = names.find(std::string(word));
    if (!landmark)
      text::fail(table.path(), cell.line,
                 fmt::format("{} in the column {} is no landmark of {}; columns of something else are left out as in "
                             "FILE:COLUMN,COLUMN",
                             text::in_quotes(word), text::in_quotes(cell.column), shape.source));
    found.push_back(*landmark);
  }
  return found;
}

}  // namespace

void apply_absent_table(const std::string& address, LandmarkFile& file) {
  const AbsentTable table(address);
  for (Landmarks& shape : file.shapes) {
    const LandmarkLookup names(shape);
    std::set<int> absent(shape.absent.begin(), shape.absent.end());
    for (const AbsentCell& cell : table.cells_of(shape))
      for (const int a : landmarks_in(table, cell, shape, names)) {
        if (!shape.points.col(a).hasNaN())
          text::fail(table.path(), cell.line,
                     fmt::format("landmark {} is absent from {}, which has coordinates of it; where these are the mark "
                                 "of a missing one, `missing_codes` names it",
                                 shape.describe(a), shape.source));
        absent.insert(a);
        shape.points.col(a).setConstant(text::kMissing);
      }
    shape.absent.assign(absent.begin(), absent.end());
  }
}

}  // namespace pulson::formats
