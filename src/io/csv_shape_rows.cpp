#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "csv_columns.hpp"
#include "csv_layouts.hpp"
#include "pulson/core/errors.hpp"
#include "text.hpp"

namespace pulson::io {
namespace {

constexpr std::string_view kSeparators = " ._-";

/// A column as `X1` or `1.X` names it.
struct CoordinateName {
  std::size_t landmark;
  std::size_t axis;
};

std::optional<std::size_t> parse_whole(std::string_view text) {
  std::size_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && stop == end ? std::optional(number) : std::nullopt;
}

std::string_view without_separators(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kSeparators);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSeparators) - begin + 1);
}

/// `1`, `LM 1` or, as R renames columns that begin with a digit, `x1`
std::optional<std::size_t> parse_landmark(std::string_view text) {
  for (const std::string_view word : {"landmark", "point", "lm", "pt", "p", "x"})
    if (text.starts_with(word)) return parse_whole(without_separators(text.substr(word.size())));
  return parse_whole(text);
}

std::optional<CoordinateName> parse_name(std::string_view name) {
  constexpr std::string_view kAxes = "xyz";
  const std::string lower = to_lower(name);
  const std::string_view text = lower;
  if (text.size() < 2) return std::nullopt;
  if (const std::size_t axis = kAxes.find(text.back()); axis != kAxes.npos) {
    const std::optional<std::size_t> landmark = parse_landmark(without_separators(text.substr(0, text.size() - 1)));
    return landmark ? std::optional(CoordinateName{*landmark, axis}) : std::nullopt;
  }
  const std::size_t axis = kAxes.find(text.front());
  if (axis == kAxes.npos) return std::nullopt;
  const std::optional<std::size_t> landmark = parse_whole(without_separators(text.substr(1)));
  return landmark ? std::optional(CoordinateName{*landmark, axis}) : std::nullopt;
}

using ColumnsOfAxes = std::array<std::optional<std::size_t>, 3>;

struct ShapeColumns {
  std::map<std::size_t, ColumnsOfAxes> landmarks;  ///< by their number
  std::size_t dimension = 0;
  std::optional<std::size_t> name;
  std::vector<std::string> unused;
};

/// The column that names the shapes: `specimen`, else `id` and its like, else a first one without a name.
std::optional<std::size_t> find_name_column(const CsvRecord& header) {
  if (const auto specimen = find_column(header, ColumnRole::kSpecimen)) return specimen;
  if (const auto label = find_column(header, ColumnRole::kLabel)) return label;
  return header.fields.front().empty() ? std::optional<std::size_t>(0) : std::nullopt;
}

void require_all_axes(const std::string& path, const CsvRecord& header, const ShapeColumns& columns) {
  for (const auto& [number, axes] : columns.landmarks)
    for (std::size_t axis = 0; axis < columns.dimension; ++axis)
      if (!axes[axis]) fail(path, header.line, fmt::format("no column holds {} of landmark {}", "xyz"[axis], number));
}

ShapeColumns find_columns(const std::string& path, const CsvRecord& header) {
  ShapeColumns columns;
  columns.name = find_name_column(header);
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const bool is_index = i == 0 && header.fields[i].empty();
    const std::optional<CoordinateName> coordinate = parse_name(header.fields[i]);
    if (!coordinate) {
      if (i != columns.name && !is_index) columns.unused.push_back(header.fields[i]);
      continue;
    }
    std::optional<std::size_t>& column = columns.landmarks[coordinate->landmark][coordinate->axis];
    if (column)
      fail(path, header.line,
           fmt::format("the columns {} and {} mean the same, one of them is needed", in_quotes(header.fields[*column]),
                       in_quotes(header.fields[i])));
    column = i;
    columns.dimension = std::max(columns.dimension, coordinate->axis + 1);
  }
  require_all_axes(path, header, columns);
  return columns;
}

Landmarks read_shape(const std::string& path, const CsvRecord& record, const ShapeColumns& columns,
                     const std::vector<std::string>& labels, std::size_t number) {
  Landmarks shape;
  if (columns.name) shape.name = record.fields[*columns.name];
  std::vector<double> coordinates;
  for (std::size_t i = 0; const auto& [landmark, axes] : columns.landmarks) {
    CoordinatePlace place{path, record.line, labels[i++], fmt::format("shape {}", number), 0};
    for (; place.axis < columns.dimension; ++place.axis)
      coordinates.push_back(parse_coordinate(record.fields[*axes[place.axis]], place));
  }
  const auto d = static_cast<Eigen::Index>(columns.dimension);
  shape.points = Points::Map(coordinates.data(), d, static_cast<Eigen::Index>(labels.size()));
  if (!counts_from_one(labels)) shape.labels = labels;
  return shape;
}

}  // namespace

bool fits_shape_rows(const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  if (!is_header(header) || names_coordinates(header)) return false;
  std::array<bool, 3> has_axis{};
  for (const std::string& field : header.fields)
    if (const auto coordinate = parse_name(field)) has_axis[coordinate->axis] = true;
  return has_axis[0] && has_axis[1];
}

LandmarkFile read_shape_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  const ShapeColumns columns = find_columns(path, records.front());
  if (records.size() == 1) throw InputError(path + " holds a header and no landmarks");
  std::vector<std::string> labels;
  for (const auto& [number, axes] : columns.landmarks) labels.push_back(std::to_string(number));
  LandmarkFile file;
  for (std::size_t i = 1; i < records.size(); ++i)
    file.shapes.push_back(read_shape(path, records[i], columns, labels, i));
  file.warnings = unused_columns(path, columns.unused);
  return file;
}

}  // namespace pulson::io
