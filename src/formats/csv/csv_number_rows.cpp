// Tables of numbers without a header: an axis or a shape per line.

#include <algorithm>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"

namespace pulson::formats {
namespace {

/// The column `x-coordinates` or the like, first or second, with numbers after it.
std::optional<std::size_t> find_axis_column(const CsvRecord& record) {
  const auto& fields = record.fields;
  for (std::size_t i = 0; i < 2 && i + 1 < fields.size(); ++i) {
    const auto numbers = fields.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    if (axis_of_word(fields[i]) && std::all_of(numbers, fields.end(), is_number_or_missing)) return i;
  }
  return std::nullopt;
}

/// The coordinates of one shape, line by line.
struct AxisRows {
  std::size_t line;  ///< of x
  std::size_t dimension = 0;
  std::vector<double> coordinates;  ///< all x, then all y, then all z
  Landmarks shape{};

  std::size_t count() const { return coordinates.size() / dimension; }

  void add(const std::string& path, const CsvRecord& record, std::size_t first, const std::string& shape_name) {
    text::CoordinatePlace place{path, record.line, "", shape_name, dimension};
    for (std::size_t i = first; i < record.fields.size(); ++i) {
      place.landmark = std::to_string(i - first + 1);
      coordinates.push_back(text::parse_coordinate(record.fields[i], place));
    }
    ++dimension;
  }

  Landmarks finish() {
    const auto d = static_cast<Eigen::Index>(dimension);
    shape.points = Points::Map(coordinates.data(), static_cast<Eigen::Index>(count()), d).transpose();  // may be d×0
    return std::move(shape);
  }
};

class NamedAxisReader {
 public:
  NamedAxisReader(const std::string& path, std::size_t axis_column) : path_(path), axis_column_(axis_column) {}

  void add(const CsvRecord& record) {
    const std::optional<std::size_t> axis =
        record.fields.size() > axis_column_ ? axis_of_word(record.fields[axis_column_]) : std::nullopt;
    if (!axis)
      text::fail(path_, record.line,
                 fmt::format("column {} names no axis; it needs x, y or z, as in the first line", axis_column_ + 1));
    const std::string name = axis_column_ > 0 ? record.name(0) : "";
    if (*axis == 0)
      begin_shape(record.line, name);
    else
      require_next(record, *axis, name);
    shapes_.back().add(path_, record, axis_column_ + 1, fmt::format("shape {}", shapes_.size()));
  }

  LandmarkFile finish() {
    require_equal_dimensions();
    LandmarkFile file;
    for (AxisRows& rows : shapes_) file.shapes.push_back(rows.finish());
    return file;
  }

 private:
  void begin_shape(std::size_t line, const std::string& name) {
    shapes_.push_back({line, 0, {}});
    shapes_.back().shape.name = name;
  }

  void require_next(const CsvRecord& record, std::size_t axis, const std::string& name) const {
    const auto describe = [&](const std::string& text) {
      return axis_column_ > 0 ? " of " + text::in_quotes(text) : "";
    };
    if (shapes_.empty() || shapes_.back().shape.name != name || shapes_.back().dimension != axis)
      text::fail(path_, record.line,
                 fmt::format("{}{} does not follow {}; each shape needs a line of x, one of y after it, and so on",
                             text::kAxisLetters[axis], describe(name), text::kAxisLetters[axis - 1]));
    const AxisRows& rows = shapes_.back();
    const std::size_t count = record.fields.size() - axis_column_ - 1;
    if (count != rows.count())
      text::fail(path_, record.line,
                 fmt::format("{} of {}{}, but {} of x on line {}", text::counted(count, "coordinate"),
                             text::kAxisLetters[axis], describe(name), rows.count(), rows.line));
  }

  void require_equal_dimensions() const {
    const AxisRows& first = shapes_.front();
    for (const AxisRows& rows : shapes_)
      if (rows.dimension != first.dimension)
        text::fail(path_, rows.line,
                   fmt::format("a shape of {}, but the one of line {} has {}; all shapes must have the same number",
                               rows.dimension == 1 ? "1 axis" : fmt::format("{} axes", rows.dimension), first.line,
                               first.dimension));
  }

  const std::string& path_;
  std::size_t axis_column_;
  std::vector<AxisRows> shapes_;
};

}  // namespace

bool fits_named_axis_rows(const std::vector<CsvRecord>& records) {
  return find_axis_column(records.front()).has_value();
}

LandmarkFile read_named_axis_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  NamedAxisReader reader(path, *find_axis_column(records.front()));
  for (const CsvRecord& record : records) reader.add(record);
  return reader.finish();
}

bool fits_axis_rows(const std::vector<CsvRecord>& records) {
  const bool has_right_size = (records.size() == 2 || records.size() == 3) && records.front().fields.size() > 3;
  return has_right_size && std::all_of(records.begin(), records.end(), holds_numbers) && !counts_lines(records, 0, 0);
}

LandmarkFile read_axis_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  if (are_alike(records))
    text::fail(path, records.front().line,
               fmt::format("{} lines of {} numbers that are nearly the same, as shapes are and not the axes of one; a "
                           "header such as x1,y1,x2,y2,... says what they hold",
                           records.size(), records.front().fields.size()));
  AxisRows rows{records.front().line, 0, {}};
  for (const CsvRecord& record : records) rows.add(path, record, 0, "");
  LandmarkFile file;
  file.warnings = {fmt::format("{}: {} lines of {} numbers without a header, read as the axes {} of one shape", path,
                               records.size(), records.front().fields.size(),
                               records.size() == 2 ? "x, y" : "x, y, z")};
  file.shapes.push_back(rows.finish());
  return file;
}

namespace {

constexpr std::size_t kFewest = 4;  // fewer numbers after a name are a landmark

bool is_named_shape(const CsvRecord& record) {
  const auto& fields = record.fields;
  return fields.size() > kFewest && !text::is_missing(fields.front()) && !text::is_number(fields.front()) &&
         std::all_of(fields.begin() + 1, fields.end(), is_number_or_missing);
}

Landmarks read_shape(const std::string& path, const CsvRecord& record, std::size_t dimension) {
  Landmarks shape;
  shape.name = record.name(0);
  std::vector<double> coordinates;
  for (std::size_t i = 1; i < record.fields.size(); ++i) {
    const text::CoordinatePlace place{path, record.line, std::to_string((i - 1) / dimension + 1),
                                      text::in_quotes(shape.name), (i - 1) % dimension};
    coordinates.push_back(text::parse_coordinate(record.fields[i], place));
  }
  shape.points = text::points_from(coordinates, dimension);
  return shape;
}

}  // namespace

// 2 or 3, whichever parts the numbers of a line.
std::size_t dimension_of_named_shape(const std::string& path, const CsvRecord& first) {
  const std::size_t count = first.fields.size() - 1;
  if (count % 6 == 0)
    text::fail(path, first.line,
               fmt::format("a name and {} numbers may be {} landmarks in 2D or {} in 3D; a header id,x1,y1,... or "
                           "id,x1,y1,z1,... says which",
                           count, count / 2, count / 3));
  if (count % 2 != 0 && count % 3 != 0)
    text::fail(path, first.line, fmt::format("a name and {} numbers, which landmarks in 2D or 3D cannot have", count));
  return count % 2 == 0 ? 2 : 3;
}

bool fits_named_shape_rows(const std::vector<CsvRecord>& records) {
  std::set<std::string_view> seen;
  return std::all_of(records.begin(), records.end(), [&](const CsvRecord& record) {
    return is_named_shape(record) && seen.insert(record.name(0)).second;
  });
}

LandmarkFile read_named_shape_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  const std::size_t dimension = dimension_of_named_shape(path, records.front());
  LandmarkFile file;
  for (const CsvRecord& record : records) file.shapes.push_back(read_shape(path, record, dimension));
  file.warnings = {fmt::format("{}: a name and {} numbers per line without a header, read as shapes of {} in {}D", path,
                               records.front().fields.size() - 1,
                               text::counted(static_cast<std::size_t>(file.shapes.front().count()), "landmark"),
                               dimension)};
  return file;
}

}  // namespace pulson::formats
