#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "csv_columns.hpp"
#include "csv_layouts.hpp"
#include "csv_records.hpp"
#include "formats.hpp"
#include "pulson/core/errors.hpp"
#include "text.hpp"

namespace pulson::io {
namespace {

std::string field_or_empty(const CsvRecord& record, std::optional<std::size_t> column) {
  return column ? record.fields[*column] : std::string();
}

/// Gathers the lines of one shape.
class ShapeBuilder {
 public:
  ShapeBuilder(const std::string& path, const CsvColumns& columns, std::string name)
      : path_(path), columns_(columns), name_(std::move(name)) {}

  void add(const CsvRecord& record) {
    const std::string label = field_or_empty(record, columns_.label);
    const std::string group = field_or_empty(record, columns_.group);
    const std::string number = std::to_string(labels_.size() + 1);
    CoordinatePlace place{path_, record.line, label.empty() ? number : in_quotes(label), "", 0};
    if (columns_.specimen) place.shape = "specimen " + in_quotes(name_);
    for (const std::size_t column : columns_.coordinates) {
      coordinates_.push_back(parse_coordinate(record.fields[column], place));
      ++place.axis;
    }
    require_new_label(record, group, label);
    labels_.push_back(label);
    groups_.push_back(group);
  }

  Landmarks finish() {
    Landmarks shape;
    const auto d = static_cast<Eigen::Index>(columns_.coordinates.size());
    shape.points = Points::Map(coordinates_.data(), d, static_cast<Eigen::Index>(labels_.size()));
    if (columns_.label && !counts_from_one(labels_)) shape.labels = std::move(labels_);
    if (std::any_of(groups_.begin(), groups_.end(), [](const std::string& group) { return !group.empty(); }))
      shape.groups = std::move(groups_);
    shape.name = std::move(name_);
    return shape;
  }

 private:
  void require_new_label(const CsvRecord& record, const std::string& group, const std::string& label) {
    if (label.empty()) return;
    const auto [other, is_new] = line_of_label_.try_emplace({group, label}, record.line);
    if (is_new) return;
    fail(path_, record.line,
         fmt::format("landmark {}{} stands on line {} already; labels must differ within a shape, a column specimen "
                     "tells shapes apart and a column group outlines",
                     in_quotes(label), columns_.specimen ? " of specimen " + in_quotes(name_) : "", other->second));
  }

  const std::string& path_;
  const CsvColumns& columns_;
  std::string name_;
  std::vector<double> coordinates_;
  std::vector<std::string> labels_;
  std::vector<std::string> groups_;
  std::map<std::pair<std::string, std::string>, std::size_t> line_of_label_;
};

std::string specimen_of(const std::string& path, const CsvRecord& record, const CsvColumns& columns) {
  std::string specimen = field_or_empty(record, columns.specimen);
  if (columns.specimen && specimen.empty()) fail(path, record.line, "the specimen is empty; each line needs one");
  return specimen;
}

std::vector<Landmarks> shapes_of(const std::string& path, const std::vector<CsvRecord>& records,
                                 const CsvColumns& columns) {
  std::vector<ShapeBuilder> builders;
  std::map<std::string, std::size_t> place;
  for (const CsvRecord& record : records) {
    const std::string specimen = specimen_of(path, record, columns);
    const auto [it, is_new] = place.try_emplace(specimen, builders.size());
    if (is_new) builders.emplace_back(path, columns, specimen);
    builders[it->second].add(record);
  }
  std::vector<Landmarks> shapes;
  shapes.reserve(builders.size());
  for (ShapeBuilder& builder : builders) shapes.push_back(builder.finish());
  return shapes;
}

/// Whether x is 1, 2, 3, ... or 0, 1, 2, ...: then it may be an index and no coordinate.
bool looks_like_index(const Points& points) {
  if (points.rows() < 2 || points.cols() < 3) return false;
  const double first = points(0, 0);
  if (first != 0 && first != 1) return false;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (points(0, i) != first + static_cast<double>(i)) return false;
  return true;
}

std::vector<std::string> doubts_without_header(const std::string& path, const Landmarks& shape) {
  if (shape.dimension() == 1)
    return {fmt::format("{}: one column without a header, read as {} on a line (1D)", path,
                        counted(static_cast<std::size_t>(shape.count()), "landmark"))};
  if (looks_like_index(shape.points))
    return {path +
            ": the first column counts the lines and is read as the coordinate x; if it is an index, give the "
            "table a header such as id,x,y"};
  return {};
}

/// Whether the first line tells that the table has a landmark on each.
bool begins_with_points(const std::vector<CsvRecord>& first) {
  if (is_header(first.front())) return names_coordinates(first.front());
  return !holds_only_marks(first.front()) && holds_numbers(first.front());
}

LandmarkFile read_point_rows(const std::string& path, std::vector<CsvRecord> records) {
  const bool has_names = holds_named_points(records);
  const bool has_header = !has_names && is_header(records.front());
  const CsvColumns columns = has_names    ? columns_of_named_points(records.front())
                             : has_header ? columns_of_header(path, records.front())
                                          : columns_without_header(path, records.front());
  require_equal_lengths(path, records);
  if (has_header) records.erase(records.begin());
  if (records.empty()) throw InputError(path + " holds a header and no landmarks");
  LandmarkFile file;
  file.shapes = shapes_of(path, records, columns);
  if (has_header) file.warnings = unused_columns(path, columns.unused);
  if (!has_header && !has_names) file.warnings = doubts_without_header(path, file.shapes.front());
  return file;
}

}  // namespace

bool sniff_csv(std::string_view text) {
  constexpr std::size_t kTelling = 64;
  try {
    const std::vector<CsvRecord> first = csv_records("", text, 1);
    if (first.empty()) return false;
    if (begins_with_points(first)) return true;
    const std::vector<CsvRecord> several = csv_records("", text, kTelling);
    if (find_layout(several) != nullptr || holds_named_points(several)) return true;
    if (!holds_only_marks(first.front())) return false;
    const std::vector<CsvRecord> all = csv_records("", text);
    const auto telling = std::find_if_not(all.begin(), all.end(), holds_only_marks);
    return telling != all.end() && holds_numbers(*telling);
  } catch (const InputError&) {
    return false;
  }
}

LandmarkFile read_csv(const std::string& path, std::string_view text) {
  std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty()) throw InputError(path + " holds only blank lines and comments; it needs lines x[,y[,z]]");
  const CsvLayout* const layout = find_layout(records);
  return layout != nullptr ? layout->read(path, records) : read_point_rows(path, std::move(records));
}

}  // namespace pulson::io
