// Tables of the lines of a wireframe: two landmarks in each row.

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/shape_options.hpp"
#include "formats/tables/landmark_lookup.hpp"
#include "pulson/core/errors.hpp"

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
    text::fail(path, rows.back().line,
               fmt::format("{}; a table of links has two, the landmarks that each line joins",
                           text::counted(width, "column")));
  return 0;
}

/// What a row names.
struct LinkNames {
  std::size_t line;
  std::array<std::string, 2> ends;
};

std::vector<LinkNames> read_names(const std::string& path) {
  const Rows rows = csv_records(path, text::read_text_file(path));
  if (rows.empty()) throw InputError(path + " holds no links");
  const std::size_t column = first_column(path, rows);
  std::vector<LinkNames> links;
  for (const CsvRecord& row : rows) {
    const bool names_columns = &row == &rows.front() && row.fields.size() < column + 2;
    if (names_columns) continue;
    if (row.fields.size() != column + 2)
      text::fail(path, row.line,
                 fmt::format("{}; {} are needed", text::counted(row.fields.size(), "column"), column + 2));
    links.push_back({row.line, {row.name(column), row.name(column + 1)}});
    const auto& [from, to] = links.back().ends;
    if (from == to)
      text::fail(path, row.line, fmt::format("the landmark {} is joined to itself", text::in_quotes(from)));
    if (from == "0" || to == "0")
      text::fail(path, row.line, "there is no landmark 0: links count from 1; add 1 to all numbers of a table from 0");
  }
  return links;
}

}  // namespace

void apply_links(const std::string& path, LandmarkFile& file) {
  const std::vector<LinkNames> rows = read_names(path);
  std::vector<std::string> lacking(rows.size());  // what the first shape without both ends lacks
  for (Landmarks& shape : file.shapes) {
    const LandmarkLookup names(shape);
    shape.links.clear();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::optional<int> from = names.find(rows[i].ends[0]), to = names.find(rows[i].ends[1]);
      if (from && to)
        shape.links.emplace_back(*from, *to);
      else if (lacking[i].empty())
        lacking[i] = fmt::format("{} is no landmark of {}", text::in_quotes(rows[i].ends[from ? 1 : 0]), shape.source);
    }
  }
  const auto has_links = [](const Landmarks& shape) { return !shape.links.empty() || shape.count() == 0; };
  if (std::none_of(file.shapes.begin(), file.shapes.end(), has_links))
    text::fail(path, rows.back().line,
               fmt::format("{}; the columns need labels of the landmarks, or their numbers from 1", lacking.back()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool names_columns = i == 0 && !lacking[0].empty() && !text::is_number(rows[0].ends[0]);
    if (!lacking[i].empty() && !names_columns)
      file.warnings.push_back(fmt::format("{}:{}: {}; the link is left out there", path, rows[i].line, lacking[i]));
  }
}

}  // namespace pulson::formats
