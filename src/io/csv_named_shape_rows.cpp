#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "csv_columns.hpp"
#include "csv_layouts.hpp"
#include "text.hpp"

namespace pulson::io {
namespace {

constexpr std::size_t kFewest = 4;  // fewer numbers after a name are a landmark

bool is_named_shape(const CsvRecord& record) {
  const auto& fields = record.fields;
  return fields.size() > kFewest && !is_missing(fields.front()) && !is_number(fields.front()) &&
         std::all_of(fields.begin() + 1, fields.end(), is_number_or_missing);
}

/// 2 or 3, whichever parts the numbers of a line. @throws InputError if both do or neither
std::size_t find_dimension(const std::string& path, const CsvRecord& first) {
  const std::size_t count = first.fields.size() - 1;
  if (count % 6 == 0)
    fail(path, first.line,
         fmt::format("a name and {} numbers may be {} landmarks in 2D or {} in 3D; a header id,x1,y1,... or "
                     "id,x1,y1,z1,... says which",
                     count, count / 2, count / 3));
  if (count % 2 != 0 && count % 3 != 0)
    fail(path, first.line, fmt::format("a name and {} numbers, which landmarks in 2D or 3D cannot have", count));
  return count % 2 == 0 ? 2 : 3;
}

Landmarks read_shape(const std::string& path, const CsvRecord& record, std::size_t dimension) {
  Landmarks shape;
  shape.name = record.fields.front();
  std::vector<double> coordinates;
  for (std::size_t i = 1; i < record.fields.size(); ++i) {
    const CoordinatePlace place{path, record.line, std::to_string((i - 1) / dimension + 1), in_quotes(shape.name),
                                (i - 1) % dimension};
    coordinates.push_back(parse_coordinate(record.fields[i], place));
  }
  shape.points = Points::Map(coordinates.data(), static_cast<Eigen::Index>(dimension),
                             static_cast<Eigen::Index>(coordinates.size() / dimension));
  return shape;
}

}  // namespace

bool fits_named_shape_rows(const std::vector<CsvRecord>& records) {
  std::set<std::string_view> seen;
  return std::all_of(records.begin(), records.end(), [&](const CsvRecord& record) {
    return is_named_shape(record) && seen.insert(record.fields.front()).second;
  });
}

LandmarkFile read_named_shape_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  const std::size_t dimension = find_dimension(path, records.front());
  LandmarkFile file;
  for (const CsvRecord& record : records) file.shapes.push_back(read_shape(path, record, dimension));
  file.warnings = {fmt::format("{}: a name and {} numbers per line without a header, read as shapes of {} in {}D", path,
                               records.front().fields.size() - 1,
                               counted(static_cast<std::size_t>(file.shapes.front().count()), "landmark"), dimension)};
  return file;
}

}  // namespace pulson::io
