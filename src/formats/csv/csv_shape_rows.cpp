#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "formats/text/text_lines.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kNameSeparators = " ._-:()[]";

std::string_view without_separators(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kNameSeparators);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kNameSeparators) - begin + 1);
}

/// `1`, `LM 1` or, as R renames columns that begin with a digit, `x1`
std::optional<std::size_t> parse_landmark(std::string_view text) {
  for (const std::string_view word : {"landmark", "point", "lm", "pt", "p", "x"})
    if (text.starts_with(word)) return parse_count(without_separators(text.substr(word.size())));
  return parse_count(text);
}

bool is_separator(char c) { return kNameSeparators.find(c) != kNameSeparators.npos; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

/// Whether the last letter stands apart from those before it: `nose_x`, `noseX`, `L1x`.
bool ends_in_letter(std::string_view text) {
  const char before = text[text.size() - 2];
  return is_separator(before) || text::is_digit(before) || (is_upper(text.back()) && !is_upper(before));
}

}  // namespace

std::optional<CoordinateName> parse_numbered_coordinate(std::string_view name) {
  const std::string lower = text::to_lower(name);
  const std::string_view text = lower;
  if (text.size() < 2) return std::nullopt;
  std::optional<CoordinateName> found;
  if (const std::size_t axis = text::kAxisLetters.find(text.back()); axis != text::kAxisLetters.npos)
    found = {axis, parse_landmark(without_separators(text.substr(0, text.size() - 1))), ""};
  else if (const std::size_t first = text::kAxisLetters.find(text.front()); first != text::kAxisLetters.npos)
    found = {first, parse_landmark(without_separators(text.substr(1))), ""};
  return found && found->number ? found : std::nullopt;
}

std::optional<CoordinateName> parse_named_coordinate(std::string_view name) {
  const std::string_view text = name.substr(0, name.find_last_not_of(")]") + 1);
  if (text.size() < 2) return std::nullopt;
  const std::string lower = text::to_lower(text);
  std::optional<CoordinateName> found;
  if (const std::size_t axis = text::kAxisLetters.find(lower.back());
      axis != text::kAxisLetters.npos && ends_in_letter(text))
    found = {axis, {}, std::string(without_separators(text.substr(0, text.size() - 1)))};
  else if (const std::size_t first = text::kAxisLetters.find(lower.front());
           first != text::kAxisLetters.npos && is_separator(text[1]))
    found = {first, {}, std::string(without_separators(text.substr(1)))};
  return found && !found->label.empty() ? found : std::nullopt;
}

namespace {

/// A landmark and its columns.
struct ShapeLandmark {
  std::string label;
  std::array<std::optional<std::size_t>, 3> columns{};
};

struct ShapeColumns {
  std::vector<ShapeLandmark> landmarks;  ///< by their numbers, else in the order of the columns
  std::size_t dimension = 0;
  bool are_numbered = false;
  std::vector<std::size_t> names;
  std::optional<std::size_t> image;
  std::vector<std::string> unused;
};

/// What the names of landmarks are where a line holds one landmark of several shapes, or a box.
bool names_other_things(const std::string& label) {
  constexpr std::array<std::string_view, 19> kOthers = {
      "source", "target", "src", "dst",       "fixed",    "moving", "from", "to", "start", "end",
      "before", "after",  "ref", "reference", "template", "min",    "max",  "p",  "q"};
  return std::find(kOthers.begin(), kOthers.end(), text::to_lower(label)) != kOthers.end();
}

bool holds_landmark_per_line(const CsvRecord& header) {
  const std::vector<RankedColumn> labels = find_columns(header, ColumnRole::kLabel);
  return !labels.empty() && labels.front().rank == kLandmarkRank;
}

/// Whether some columns are `x1`, `2.X` and some `y1`.
bool numbers_landmarks(const CsvRecord& header) {
  std::array<bool, 2> has_axis{};
  for (const std::string& field : header.fields)
    if (const auto name = parse_numbered_coordinate(field); name && name->axis < 2) has_axis[name->axis] = true;
  return has_axis[0] && has_axis[1];
}

bool finds_named_landmarks(const CsvRecord& header) {
  std::map<std::string, std::array<bool, 3>> axes;
  for (const std::string& field : header.fields)
    if (const auto name = parse_named_coordinate(field); name && !names_other_things(name->label))
      axes[name->label][name->axis] = true;
  return !holds_landmark_per_line(header) &&
         std::any_of(axes.begin(), axes.end(), [](const auto& entry) { return entry.second[0] && entry.second[1]; });
}

/// The columns that name the shapes: `specimen`, else `id` and its like, else `file` or `frame`, else a first one
/// without a name. Names that repeat are followed by further columns that distinguish them, as SLEAP has `track` and
/// `frame_idx`.
std::vector<std::size_t> find_name_columns(const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  std::vector<RankedColumn> candidates = find_columns(header, ColumnRole::kSpecimen);
  const auto labels = find_columns(header, ColumnRole::kLabel);
  const auto files = std::find_if(candidates.begin(), candidates.end(), [](auto c) { return c.rank >= kImageRank; });
  if (files == candidates.begin() && !labels.empty()) return {labels.front().column};
  if (candidates.empty())
    return header.fields.front().empty() ? std::vector<std::size_t>{0} : std::vector<std::size_t>{};
  std::vector<std::size_t> names;
  for (const RankedColumn& candidate : candidates) {
    names.push_back(candidate.column);
    std::set<std::string> seen;
    const bool are_unique = std::all_of(records.begin() + 1, records.end(), [&](const CsvRecord& record) {
      return seen.insert(joined_fields(record, names)).second;
    });
    if (are_unique) break;
  }
  return names;
}

class ShapeColumnFinder {
 public:
  ShapeColumnFinder(const std::string& path, const CsvRecord& header) : path_(path), header_(header) {
    columns_.are_numbered = numbers_landmarks(header);
  }

  ShapeColumns find(std::vector<std::size_t> names) {
    columns_.names = std::move(names);
    for (const RankedColumn& column : find_columns(header_, ColumnRole::kSpecimen))
      if (column.rank == kImageRank && !columns_.image) columns_.image = column.column;
    for (std::size_t i = 0; i < header_.fields.size(); ++i) add(i);
    if (columns_.are_numbered) order_by_number();
    require_all_axes();
    return std::move(columns_);
  }

 private:
  void add(std::size_t i) {
    const std::string& field = header_.fields[i];
    const std::optional<CoordinateName> name =
        columns_.are_numbered ? parse_numbered_coordinate(field) : parse_named_coordinate(field);
    if (!name) {
      const bool is_index = i == 0 && field.empty();
      const bool is_name = std::find(columns_.names.begin(), columns_.names.end(), i) != columns_.names.end();
      if (!is_index && !is_name && i != columns_.image) columns_.unused.push_back(field);
      return;
    }
    std::optional<std::size_t>& column = landmark_of(*name).columns[name->axis];
    if (column)
      text::fail(path_, header_.line,
                 fmt::format("the columns {} and {} mean the same; give only one",
                             text::in_quotes(header_.fields[*column]), text::in_quotes(field)));
    column = i;
    columns_.dimension = std::max(columns_.dimension, name->axis + 1);
  }

  ShapeLandmark& landmark_of(const CoordinateName& name) {
    const std::string label = name.number ? std::to_string(*name.number) : name.label;
    require_short_name(path_, header_, label);
    const auto [entry, is_new] = places_.try_emplace(label, columns_.landmarks.size());
    if (is_new) columns_.landmarks.push_back({label});
    return columns_.landmarks[entry->second];
  }

  void order_by_number() {
    std::sort(columns_.landmarks.begin(), columns_.landmarks.end(), [](const auto& a, const auto& b) {
      return std::pair(a.label.size(), a.label) < std::pair(b.label.size(), b.label);
    });
  }

  void require_all_axes() const {
    for (const ShapeLandmark& landmark : columns_.landmarks)
      for (std::size_t axis = 0; axis < columns_.dimension; ++axis)
        if (!landmark.columns[axis])
          text::fail(path_, header_.line,
                     fmt::format("no column holds {} of landmark {}", text::kAxisLetters[axis],
                                 columns_.are_numbered ? landmark.label : text::in_quotes(landmark.label)));
  }

  const std::string& path_;
  const CsvRecord& header_;
  std::map<std::string, std::size_t> places_;
  ShapeColumns columns_;
};

Landmarks read_shape(const std::string& path, const CsvRecord& record, const ShapeColumns& columns,
                     const std::vector<std::string>& labels, std::size_t number) {
  Landmarks shape;
  shape.name = joined_fields(record, columns.names);
  const std::optional<std::size_t> image =
      columns.image || columns.names.size() != 1 ? columns.image : std::optional(columns.names.front());
  if (image && names_image(record.fields[*image])) shape.image = record.fields[*image];
  std::vector<double> coordinates;
  for (const ShapeLandmark& landmark : columns.landmarks) {
    text::CoordinatePlace place{path, record.line, landmark.label, fmt::format("shape {}", number), 0};
    for (; place.axis < columns.dimension; ++place.axis)
      coordinates.push_back(text::parse_coordinate(record.fields[*landmark.columns[place.axis]], place));
  }
  shape.points = text::points_from(coordinates, columns.dimension);
  shape.labels = labels;
  return shape;
}

}  // namespace

bool fits_shape_rows(const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  if (!is_header(header) || names_plain_coordinates(header)) return false;
  if (numbers_landmarks(header)) return true;
  return !names_coordinates(header) && finds_named_landmarks(header);
}

std::vector<std::vector<std::size_t>> columns_of_shape_rows(const std::string& path, const CsvRecord& header) {
  const ShapeColumns columns = ShapeColumnFinder(path, header).find({});
  std::vector<std::vector<std::size_t>> landmarks;
  for (const ShapeLandmark& landmark : columns.landmarks) {
    landmarks.emplace_back();
    for (std::size_t axis = 0; axis < columns.dimension; ++axis) landmarks.back().push_back(*landmark.columns[axis]);
  }
  return landmarks;
}

LandmarkFile read_shape_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  require_equal_lengths(path, records);
  const ShapeColumns columns = ShapeColumnFinder(path, records.front()).find(find_name_columns(records));
  if (records.size() == 1) throw InputError(path + " holds a header and no landmarks");
  std::vector<std::string> labels;
  for (const ShapeLandmark& landmark : columns.landmarks) labels.push_back(landmark.label);
  if (counts_from_one(labels)) labels.clear();
  LandmarkFile file;
  for (std::size_t i = 1; i < records.size(); ++i)
    file.shapes.push_back(read_shape(path, records[i], columns, labels, i));
  file.warnings = unused_columns(path, columns.unused);
  if (!columns.are_numbered && columns.landmarks.size() == 1 && records.size() > 2)
    file.warnings.push_back(fmt::format("{}: each line is read as a shape of one landmark", path));
  return file;
}

}  // namespace pulson::formats
