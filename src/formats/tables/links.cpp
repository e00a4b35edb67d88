// Tables of the lines of a wireframe: two landmarks in each row.

#include <map>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

using Rows = std::vector<CsvRecord>;

/// The two columns: the last of three where the first counts the rows, as R writes row names.
std::size_t first_column(const std::string& path, const Rows& rows) {
  const std::size_t width = rows.back().fields.size();
  const bool has_header =
      rows.size() > 1 && (rows.front().fields.front().empty() || rows.front().fields.size() + 1 == width);
  if (width == 3 && has_header) return 1;
  if (width != 2)
    io::fail(
        path, rows.back().line,
        fmt::format("{}; a table of links has two, the landmarks that each line joins", io::counted(width, "column")));
  return 0;
}

/// Landmarks by their labels or, where the table has numbers that are no labels, by these.
class LandmarkNames {
 public:
  explicit LandmarkNames(const Landmarks& shape) : shape_(shape) {
    for (int a = 0; a < shape.count(); ++a) {
      numbers_.try_emplace(std::to_string(shape.number(a)), a);
      if (!shape.labels.empty()) labels_.try_emplace(shape.labels[static_cast<std::size_t>(a)], a);
    }
  }

  bool has(const std::string& name) const { return labels_.contains(name) || numbers_.contains(name); }

  int find(const std::string& path, const CsvRecord& row, const std::string& name) const {
    if (const auto label = labels_.find(name); label != labels_.end()) return label->second;
    if (const auto number = numbers_.find(name); number != numbers_.end()) return number->second;
    if (name == "0")
      io::fail(path, row.line,
               "the landmark 0; links count landmarks from 1, so add 1 to all of a table that is from 0");
    const std::string near = shape_.labels.empty() ? "" : nearest_name(name, shape_.labels);
    io::fail(path, row.line,
             fmt::format("{} is no landmark of {}{}", io::in_quotes(name), shape_.source,
                         near.empty() ? fmt::format(", which has {}", shape_.count())
                                      : fmt::format("; did you mean {}?", io::in_quotes(near))));
  }

 private:
  const Landmarks& shape_;
  std::map<std::string, int> labels_, numbers_;
};

}  // namespace

std::vector<std::pair<int, int>> read_links(const std::filesystem::path& path, const Landmarks& shape) {
  const std::string name = path.string();
  const Rows rows = csv_records(name, io::read_text_file(path));
  if (rows.empty()) throw InputError(name + " holds no links");
  const std::size_t column = first_column(name, rows);
  const LandmarkNames names(shape);
  std::vector<std::pair<int, int>> links;
  for (const CsvRecord& row : rows) {
    const bool is_first = &row == &rows.front();
    if (is_first && (row.fields.size() < column + 2 || (!names.has(row.fields[column]) && is_header(row)))) continue;
    if (row.fields.size() != column + 2)
      io::fail(name, row.line, fmt::format("{}; {} are needed", io::counted(row.fields.size(), "column"), column + 2));
    const int a = names.find(name, row, row.name(column)), b = names.find(name, row, row.name(column + 1));
    if (a == b) io::fail(name, row.line, fmt::format("the landmark {} is joined to itself", shape.describe(a)));
    links.emplace_back(a, b);
  }
  return links;
}

}  // namespace pulson::formats
