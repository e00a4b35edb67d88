#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/text.hpp"
#include "csv_columns.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {

const CsvLayout* find_layout(const std::vector<CsvRecord>& records) {
  static constexpr std::array<CsvLayout, 6> kLayouts = {{
      {fits_coordinate_rows, read_coordinate_rows},
      {fits_shape_rows, read_shape_rows},
      {fits_named_axis_rows, read_named_axis_rows},
      {fits_size_rows, read_size_rows},
      {fits_axis_rows, read_axis_rows},
      {fits_named_shape_rows, read_named_shape_rows},
  }};
  const auto* const found =
      std::find_if(kLayouts.begin(), kLayouts.end(), [&](const CsvLayout& layout) { return layout.fits(records); });
  return found == kLayouts.end() ? nullptr : found;
}

void require_equal_lengths(const std::string& path, const std::vector<CsvRecord>& records) {
  const CsvRecord& first = records.front();
  for (const CsvRecord& record : records)
    if (record.fields.size() != first.fields.size())
      text::fail(path, record.line,
                 fmt::format("{}, but line {} has {}; all lines must have the same number",
                             text::counted(record.fields.size(), "column"), first.line, first.fields.size()));
}

std::vector<std::string> unused_columns(const std::string& path, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  constexpr std::size_t kMost = 8;
  std::vector<std::string> quoted;
  for (const std::string& name : names) quoted.push_back(text::in_quotes(name));
  return {path + ": columns that are not used: " + text::first_of(std::move(quoted), kMost)};
}

bool counts_from_one(const std::vector<std::string>& labels) {
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != std::to_string(i + 1)) return false;
  return true;
}

namespace {

struct NamedRole {
  std::string_view key;  ///< of ReadOptions::columns
  ColumnRole role;
  std::string_view name;  ///< of the column that has the role before all others
};

constexpr std::array<NamedRole, 7> kRoles = {{{"x", ColumnRole::kX, "x"},
                                              {"y", ColumnRole::kY, "y"},
                                              {"z", ColumnRole::kZ, "z"},
                                              {"name", ColumnRole::kLabel, "landmark"},
                                              {"specimen", ColumnRole::kSpecimen, "specimen"},
                                              {"group", ColumnRole::kGroup, "group"},
                                              {"absent", ColumnRole::kAbsent, "absent"}}};

const NamedRole& role_named(const std::string& key) {
  const auto* const found =
      std::find_if(kRoles.begin(), kRoles.end(), [&](const NamedRole& role) { return role.key == key; });
  if (found != kRoles.end()) return *found;
  throw InputError(
      fmt::format("'{}' is not the name of a kind of column; valid: x, y, z, name, specimen, group, absent", key));
}

std::string list_columns(const CsvRecord& header) {
  constexpr std::size_t kMost = 20;
  const std::size_t shown = std::min(kMost, header.fields.size());
  std::string list;
  for (std::size_t i = 0; i < shown; ++i) list += (i > 0 ? ", " : "") + text::in_quotes(header.fields[i]);
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
  text::fail(path, header.line,
             fmt::format("no column {}{}; the columns are {}", text::in_quotes(name),
                         near.empty() ? "" : ", did you mean " + text::in_quotes(near) + "?", list_columns(header)));
}

/// Whether a column would compete with one that is chosen for the role. Images may stand beside specimens.
bool competes(const std::string& name, ColumnRole role) {
  const std::optional<ColumnMeaning> meaning = meaning_of(name);
  return meaning && meaning->role == role && (role != ColumnRole::kSpecimen || meaning->rank < kImageRank);
}

}  // namespace

void name_columns(const std::string& path, CsvRecord& header, const std::map<std::string, std::string>& columns) {
  if (!is_header(header))
    text::fail(path, header.line, "the first line names no columns: " + list_columns(header) + "; a header is needed");
  std::vector<std::pair<std::size_t, const NamedRole*>> chosen;
  for (const auto& [key, name] : columns) {
    const std::size_t column = find_by_name(path, header, name);
    for (const auto& other : chosen)
      if (other.first == column)
        text::fail(
            path, header.line,
            fmt::format("the column {} cannot hold both {} and {}", text::in_quotes(name), other.second->key, key));
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
    text::fail(path, records.back().line,
               fmt::format("{} in one column; with {} coordinates for each landmark a multiple of {} is needed",
                           text::counted(count, "number"), dimension, dimension));
  std::vector<double> coordinates;
  for (std::size_t i = begin; i < records.size(); ++i) {
    const std::size_t place = i - begin;
    coordinates.push_back(
        text::parse_coordinate(records[i].fields.front(),
                               {path, records[i].line, std::to_string(place / dimension + 1), "", place % dimension}));
  }
  LandmarkFile file;
  file.shapes.emplace_back().points = text::points_from(coordinates, dimension);
  return file;
}

namespace {

bool names_axis(std::string_view column) {
  constexpr std::array<std::string_view, 6> kNames = {"pos", "axis", "coordinate", "coord", "dim", "dimension"};
  return std::find(kNames.begin(), kNames.end(), text::to_lower(column)) != kNames.end();
}

bool names_value(std::string_view column) { return text::to_lower(column) == "value"; }

std::optional<std::size_t> find_named(const CsvRecord& header, bool (*is_right)(std::string_view)) {
  const auto found = std::find_if(header.fields.begin(), header.fields.end(), is_right);
  if (found == header.fields.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header.fields.begin());
}

/// Columns of the table, counted from 0.
struct CoordinateColumns {
  std::size_t axis;
  std::size_t value;
  std::size_t label;
  std::optional<std::size_t> group;
  std::optional<std::size_t> specimen;

  bool has(std::size_t column) const {
    return column == axis || column == value || column == label || column == group || column == specimen;
  }
};

CoordinateColumns find_columns(const std::string& path, const CsvRecord& header) {
  const std::optional<std::size_t> label = find_column(header, ColumnRole::kLabel);
  if (!label)
    text::fail(path, header.line,
               "a table with a coordinate per line needs a column landmark beside the axis and the value");
  return {*find_named(header, names_axis), *find_named(header, names_value), *label,
          find_column(header, ColumnRole::kGroup), find_column(header, ColumnRole::kSpecimen)};
}

/// `x`, `1` and `pos1` are the first axis.
std::size_t parse_axis(const std::string& path, const CsvRecord& record, const std::string& field) {
  if (const std::optional<std::size_t> axis = axis_of_word(field)) return *axis;
  const std::string lower = text::to_lower(field);
  const std::string_view number = std::string_view(lower).substr(lower.starts_with("pos") ? 3 : 0);
  constexpr std::array<std::string_view, 3> kNumbers = {"1", "2", "3"};
  const auto* const found = std::find(kNumbers.begin(), kNumbers.end(), number);
  if (found == kNumbers.end())
    text::fail(path, record.line,
               "the axis is " + text::in_quotes(field) + "; valid: x, y, z or 1, 2, 3 or pos1, pos2, pos3");
  return static_cast<std::size_t>(found - kNumbers.begin());
}

struct GatheredLandmark {
  std::string group;
  std::string label;
  std::size_t first_line;
  std::array<double, 3> values{};
  std::array<std::size_t, 3> lines{};  ///< where each value stands; 0: nowhere
};

/// Gathers the coordinates of one shape.
class CoordinateGatherer {
 public:
  CoordinateGatherer(const std::string& path, const CoordinateColumns& columns, std::string name)
      : path_(path), columns_(columns), name_(std::move(name)) {}

  /// @return the axis of the line
  std::size_t add(const CsvRecord& record) {
    const std::string group = columns_.group ? record.name(*columns_.group) : "";
    const std::string& label = record.name(columns_.label);
    if (label.empty()) text::fail(path_, record.line, "the landmark has no name; each line needs one");
    const auto [place, is_new] = place_.try_emplace({group, label}, landmarks_.size());
    if (is_new) landmarks_.push_back({group, label, record.line});
    const std::size_t axis = parse_axis(path_, record, record.fields[columns_.axis]);
    GatheredLandmark& landmark = landmarks_[place->second];
    if (landmark.lines[axis] != 0)
      text::fail(path_, record.line,
                 fmt::format("{} of {} is already on line {}", "xyz"[axis], describe(landmark), landmark.lines[axis]));
    landmark.lines[axis] = record.line;
    const std::string shape = columns_.specimen ? "specimen " + text::in_quotes(name_) : "";
    landmark.values[axis] = text::parse_coordinate(record.fields[columns_.value],
                                                   {path_, record.line, text::in_quotes(label), shape, axis});
    return axis;
  }

  Landmarks finish(std::size_t dimension) {
    Landmarks shape;
    shape.name = name_;
    shape.points.resize(static_cast<Eigen::Index>(dimension), static_cast<Eigen::Index>(landmarks_.size()));
    for (std::size_t i = 0; i < landmarks_.size(); ++i) {
      require_axes(landmarks_[i], dimension);
      for (std::size_t axis = 0; axis < dimension; ++axis)
        shape.points(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(i)) = landmarks_[i].values[axis];
      shape.labels.push_back(landmarks_[i].label);
      if (columns_.group) shape.groups.push_back(landmarks_[i].group);
    }
    if (counts_from_one(shape.labels)) shape.labels.clear();
    return shape;
  }

 private:
  std::string describe(const GatheredLandmark& landmark) const {
    return fmt::format("landmark {}{}", text::in_quotes(landmark.label),
                       columns_.specimen ? " of specimen " + text::in_quotes(name_) : "");
  }

  void require_axes(const GatheredLandmark& landmark, std::size_t dimension) const {
    for (std::size_t axis = 0; axis < dimension; ++axis)
      if (landmark.lines[axis] == 0)
        text::fail(path_, landmark.first_line,
                   fmt::format("{} has no line with its {}; where that is missing, write NA", describe(landmark),
                               "xyz"[axis]));
  }

  const std::string& path_;
  const CoordinateColumns& columns_;
  std::string name_;
  std::vector<GatheredLandmark> landmarks_;
  std::map<std::pair<std::string, std::string>, std::size_t> place_;
};

}  // namespace

bool fits_coordinate_rows(const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  return is_header(header) && !names_coordinates(header) && find_named(header, names_axis) &&
         find_named(header, names_value);
}

LandmarkFile read_coordinate_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  const CsvRecord& header = records.front();
  const CoordinateColumns columns = find_columns(path, header);
  std::vector<CoordinateGatherer> gatherers;
  std::map<std::string, std::size_t> place;
  std::size_t dimension = 0;
  for (std::size_t i = 1; i < records.size(); ++i) {
    const std::string specimen = columns.specimen ? records[i].name(*columns.specimen) : "";
    if (columns.specimen && specimen.empty())
      text::fail(path, records[i].line, "the specimen is empty; each line needs one");
    const auto [entry, is_new] = place.try_emplace(specimen, gatherers.size());
    if (is_new) gatherers.emplace_back(path, columns, specimen);
    dimension = std::max(dimension, gatherers[entry->second].add(records[i]) + 1);
  }
  if (gatherers.empty()) throw InputError(path + " holds a header and no landmarks");
  LandmarkFile file;
  for (CoordinateGatherer& gatherer : gatherers) file.shapes.push_back(gatherer.finish(dimension));
  std::vector<std::string> unused;
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (!columns.has(i)) unused.push_back(header.fields[i]);
  file.warnings = unused_columns(path, unused);
  return file;
}

}  // namespace pulson::formats
