#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "formats/formats.hpp"
#include "formats/frame_text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

std::string name_or_empty(const CsvRecord& record, std::optional<std::size_t> column) {
  return column ? record.name(*column) : std::string();
}

bool is_undefined(const CsvRecord& record, const CsvColumns& columns) {
  if (!columns.defined) return false;
  const std::string field = text::to_lower(record.fields[*columns.defined]);
  return field == "0" || field == "false";
}

bool is_absent(const std::string& path, const CsvRecord& record, const CsvColumns& columns) {
  if (!columns.absent) return false;
  const std::string field = text::to_lower(record.fields[*columns.absent]);
  if (text::is_missing(field) || field == "0" || field == "false" || field == "no") return false;
  if (field == "1" || field == "true" || field == "yes" || field == "absent") return true;
  text::fail(
      path, record.line,
      fmt::format("the column absent has {}; it is 1, true or yes where the specimen does not have the landmark, "
                  "else 0, false, no or empty",
                  text::in_quotes(field)));
}

/// Gathers the lines of one shape.
class ShapeBuilder {
 public:
  ShapeBuilder(const std::string& path, const CsvColumns& columns, std::string name)
      : path_(path), columns_(columns), name_(std::move(name)) {}

  void add(const CsvRecord& record) {
    const std::string label = name_or_empty(record, columns_.label);
    const std::string group = name_or_empty(record, columns_.group);
    const std::string number = std::to_string(labels_.size() + 1);
    text::CoordinatePlace place{path_, record.line, label.empty() ? number : text::in_quotes(label), "", 0};
    if (!columns_.specimen.empty()) place.shape = "specimen " + text::in_quotes(name_);
    const bool is_missing = is_undefined(record, columns_);
    for (const std::size_t column : columns_.coordinates) {
      const double value = text::parse_coordinate(record.fields[column], place);
      coordinates_.push_back(is_missing ? std::numeric_limits<double>::quiet_NaN() : value);
      ++place.axis;
    }
    if (is_absent(path_, record, columns_)) add_absent(record);
    if (image_.empty() && columns_.image && names_image(record.fields[*columns_.image]))
      image_ = record.fields[*columns_.image];
    require_new_label(record, group, label);
    labels_.push_back(label);
    groups_.push_back(group);
  }

  Landmarks finish() {
    Landmarks shape;
    shape.points = text::points_from(coordinates_, columns_.coordinates.size());
    if (columns_.are_numbered || (columns_.label && counts_from_one(labels_))) {
      shape.numbers.resize(labels_.size());
      std::iota(shape.numbers.begin(), shape.numbers.end(), 1);
    } else if (columns_.label) {
      shape.labels = std::move(labels_);
    }
    shape.groups = text::unless_all_empty(std::move(groups_));
    shape.absent = std::move(absent_);
    shape.name = std::move(name_);
    shape.image = std::move(image_);
    return shape;
  }

 private:
  void add_absent(const CsvRecord& record) {
    const auto dimension = static_cast<std::ptrdiff_t>(columns_.coordinates.size());
    const auto is_missing = [](double value) { return std::isnan(value); };
    if (!std::all_of(coordinates_.end() - dimension, coordinates_.end(), is_missing))
      text::fail(path_, record.line, "the landmark is absent, and has coordinates; write NA in place of these");
    absent_.push_back(static_cast<int>(labels_.size()));
  }

  void require_new_label(const CsvRecord& record, const std::string& group, const std::string& label) {
    if (label.empty()) return;
    const auto [other, is_new] = line_of_label_.try_emplace({group, label}, record.line);
    if (is_new) return;
    text::fail(path_, record.line,
               fmt::format("landmark {}{} is already on line {}; labels must differ within a shape, a column specimen "
                           "distinguishes shapes and a column group distinguishes outlines",
                           text::in_quotes(label),
                           !columns_.specimen.empty() ? " of specimen " + text::in_quotes(name_) : "", other->second));
  }

  const std::string& path_;
  const CsvColumns& columns_;
  std::string name_;
  std::string image_;
  std::vector<double> coordinates_;
  std::vector<std::string> labels_;
  std::vector<std::string> groups_;
  std::vector<int> absent_;
  std::map<std::pair<std::string, std::string>, std::size_t> line_of_label_;
};

/// The specimen of each line.
class Specimens {
 public:
  Specimens(const std::string& path, const std::vector<CsvRecord>& records, const CsvColumns& columns)
      : path_(path), columns_(columns), is_named_once_(is_named_once(records)) {}

  /// The number of the specimen, from 0; blanks below a name that stands once alone repeat it.
  std::size_t of(const CsvRecord& record) {
    const std::string name = joined_fields(record, columns_.specimen);
    if (!columns_.specimen.empty() && name.empty()) {
      if (is_named_once_ && !names_.empty()) return names_.size() - 1;
      text::fail(path_, record.line, "the specimen is empty; each line needs one");
    }
    const auto [entry, is_new] = places_.try_emplace(name, names_.size());
    if (is_new) names_.push_back(name);
    return entry->second;
  }

  const std::vector<std::string>& names() const { return names_; }

 private:
  bool is_named_once(const std::vector<CsvRecord>& records) const {
    std::set<std::string_view> seen;
    return columns_.specimen.size() == 1 && std::all_of(records.begin(), records.end(), [&](const CsvRecord& record) {
             const std::string& name = record.name(columns_.specimen.front());
             return name.empty() || seen.insert(name).second;
           });
  }

  const std::string& path_;
  const CsvColumns& columns_;
  bool is_named_once_;
  std::map<std::string, std::size_t> places_;
  std::vector<std::string> names_;
};

std::vector<Landmarks> shapes_of(const std::string& path, const std::vector<CsvRecord>& records,
                                 const CsvColumns& columns) {
  std::vector<ShapeBuilder> builders;
  Specimens specimens(path, records, columns);
  for (const CsvRecord& record : records) {
    const std::size_t place = specimens.of(record);
    if (place == builders.size()) builders.emplace_back(path, columns, specimens.names().back());
    builders[place].add(record);
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

/// The number of axes, 2 or 3, that the numbers of one column look like in turn: those as far apart differ far less
/// than neighbours do. None on a line.
std::optional<int> axes_in_turn(const Points& line) {
  const auto variation = [&](Eigen::Index apart) {
    const Eigen::Index count = line.cols() - apart;
    return (line.rightCols(count) - line.leftCols(count)).cwiseAbs().sum() / static_cast<double>(count);
  };
  constexpr double kFarLess = 0.5;
  for (const int d : {2, 3})
    if (line.cols() >= 4 * d && line.cols() % d == 0 && variation(d) < kFarLess * variation(1)) return d;
  return std::nullopt;
}

std::vector<std::string> doubts_without_header(const std::string& path, const Landmarks& shape) {
  if (shape.dimension() == 1) {
    std::string doubt = fmt::format("{}: one column without a header, read as {} on a line (1D)", path,
                                    text::counted(static_cast<std::size_t>(shape.count()), "landmark"));
    if (const std::optional<int> axes = axes_in_turn(shape.points))
      doubt +=
          fmt::format("; if it holds x{} in turn, use `dimension = {}`", *axes == 2 ? " and y" : ", y and z", *axes);
    return {doubt};
  }
  if (looks_like_index(shape.points))
    return {path +
            ": the first column counts the lines and is read as the coordinate x; if it is an index, give the "
            "table a header such as id,x,y"};
  return {};
}

/// The number of equal blocks of two or more lines that blank lines part a table into; 1 where they are not equal.
std::size_t count_blocks(const std::vector<CsvRecord>& records) {
  std::vector<std::size_t> begins = {0};
  for (std::size_t i = 1; i < records.size(); ++i)
    if (records[i].follows_blank_line) begins.push_back(i);
  const std::size_t length = records.size() / begins.size();
  for (std::size_t i = 0; i < begins.size(); ++i)
    if (begins[i] != i * length) return 1;
  return length > 1 && length * begins.size() == records.size() ? begins.size() : 1;
}

/// What may be lost where landmarks are known by their order alone.
std::vector<std::string> doubts_of_order(const std::string& path, const std::vector<CsvRecord>& records,
                                         bool has_header) {
  std::vector<std::string> doubts;
  if (const std::size_t blocks = count_blocks(records); blocks > 1)
    doubts.push_back(
        fmt::format("{}: blank lines split the table into {} blocks of {} lines, which are read as one "
                    "shape; a column specimen distinguishes shapes",
                    path, blocks, records.size() / blocks));
  for (std::size_t i = has_header ? 1 : 0; i < records.size(); ++i)
    if (records[i].follows_empty_row)
      doubts.push_back(
          fmt::format("{}:{}: the empty cells above this line are no landmark; a missing one is written NA", path,
                      records[i].line));
  return doubts;
}

/// Whether the first line shows that the table has one landmark per line.
bool begins_with_points(const std::vector<CsvRecord>& first) {
  if (is_header(first.front())) return names_coordinates(first.front());
  return !holds_only_marks(first.front()) && holds_numbers(first.front());
}

LandmarkFile read_table_with_header(const std::string& path, std::vector<CsvRecord> records) {
  CsvColumns columns = columns_of_header(path, records);
  records.erase(records.begin());
  if (records.empty()) throw InputError(path + " holds a header and no landmarks");
  LandmarkFile file;
  file.shapes = shapes_of(path, records, columns);
  file.warnings = unused_columns(path, columns.unused);
  for (const std::string& note : columns.notes) file.warnings.push_back(fmt::format("{}: {}", path, note));
  if (!columns.label && columns.specimen.empty())
    for (std::string& doubt : doubts_of_order(path, records, true)) file.warnings.push_back(std::move(doubt));
  file.units = std::move(columns.units);
  file.axes = std::move(columns.axes);
  return file;
}

LandmarkFile read_table_without_header(const std::string& path, const std::vector<CsvRecord>& records) {
  const bool has_names = holds_named_points(records);
  if (records.size() > 1 && records.front().fields.size() > 3 && counts_lines(records, 0, 0))
    text::fail(path, records.front().line,
               "the first column counts the lines; the table needs a header such as id,x,y,z");
  const CsvColumns columns =
      has_names ? columns_of_named_points(records.front()) : columns_without_header(path, records.front());
  require_equal_lengths(path, records);
  LandmarkFile file;
  file.shapes = shapes_of(path, records, columns);
  if (has_names) return file;
  file.warnings = doubts_without_header(path, file.shapes.front());
  for (std::string& doubt : doubts_of_order(path, records, false)) file.warnings.push_back(std::move(doubt));
  return file;
}

LandmarkFile read_point_rows(const std::string& path, std::vector<CsvRecord> records) {
  if (!holds_named_points(records) && is_header(records.front()))
    return read_table_with_header(path, std::move(records));
  return read_table_without_header(path, records);
}

bool sniff_csv(std::string_view text) {
  constexpr std::size_t kTelling = 64;
  try {
    const std::vector<CsvRecord> first = csv_records("", text, 1);
    if (first.empty()) return false;
    if (begins_with_points(first)) return true;
    std::vector<CsvRecord> several = csv_records("", text, kTelling);
    name_numeric_header(several);
    name_unnamed_columns(several);
    if (begins_with_points(several) || numbers_coordinates(several.front()) || find_layout(several) != nullptr ||
        holds_named_points(several))
      return true;
    if (!holds_only_marks(first.front())) return false;
    const std::vector<CsvRecord> all = csv_records("", text);
    const auto telling = std::find_if_not(all.begin(), all.end(), holds_only_marks);
    return telling != all.end() && holds_numbers(*telling);
  } catch (const InputError&) {
    return false;
  }
}

LandmarkFile read_csv(const std::string& path, std::string_view text) { return read_table(path, text, {}); }

}  // namespace

namespace {

/// Whether rows may be lost as comments.
std::vector<std::string> doubts_of_comments(const std::string& path, const std::vector<CsvRecord>& records) {
  const auto found =
      std::find_if(records.begin(), records.end(), [](const CsvRecord& record) { return record.comment_row > 0; });
  if (found == records.end()) return {};
  return {
      fmt::format("{}:{}: this line looks like a row, but begins with the mark of a comment and is left out; a name "
                  "that begins so needs quotes",
                  path, found->comment_row)};
}

LandmarkFile read_records(const std::string& path, std::vector<CsvRecord> records, const ReadOptions& options) {
  if (options.dimension > 0 && is_one_column(records))
    return read_in_turn(path, records, static_cast<std::size_t>(options.dimension));
  name_unnamed_columns(records);
  if (!options.columns.empty()) {
    name_columns(path, records.front(), options.columns);
    return read_table_with_header(path, std::move(records));
  }
  std::vector<std::string> notes = name_numbered_coordinates(path, records, options.dimension);
  const CsvLayout* const layout = find_layout(records);
  LandmarkFile file = layout != nullptr ? layout->read(path, records) : read_point_rows(path, std::move(records));
  file.warnings.insert(file.warnings.begin(), notes.begin(), notes.end());
  return file;
}

}  // namespace

LandmarkFile read_table(const std::string& path, std::string_view text, const ReadOptions& options) {
  std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty()) throw InputError(path + " holds only blank lines and comments; it needs lines x[,y[,z]]");
  drop_count_line(records);
  if (options.columns.empty()) name_numeric_header(records);
  std::vector<std::string> doubts = doubts_of_comments(path, records);
  for (std::string& note : drop_summary_rows(path, records)) doubts.push_back(std::move(note));
  LandmarkFile file = read_records(path, std::move(records), options);
  if (const auto frame = frame_in_comments(path, text))
    for (Landmarks& shape : file.shapes) shape.frame = *frame;
  file.warnings.insert(file.warnings.end(), doubts.begin(), doubts.end());
  return file;
}

LandmarkFormat csv_format() {
  return {
      .name = "csv",
      .extensions = {"csv", "tsv"},
      .help =
          "table x[,y[,z]] with , ; tab or blanks between, with or without header (label, group); several shapes with "
          "a "
          "column specimen, as lines id,x1,y1,... or id,nose_x,nose_y,..., as lines of all x and all y, or as lines "
          "landmark,axis,value",
      .sniff = sniff_csv,
      .read = read_csv,
      .write = write_csv};
}

}  // namespace pulson::formats
