// Tables with a point, or the landmarks of a shape, in each row: the coordinates change, and all other columns, quotes,
// separators, comments and ends of lines stay.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "carried_file.hpp"
#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

/// Where the points of each row are.
struct RowLayout {
  std::vector<std::vector<std::size_t>> points;  ///< columns of x, y, z, counted from 0
  std::optional<std::size_t> defined{};          ///< false: the point is missing
  std::size_t header_line = 0;                   ///< 0: there is none
  std::size_t columns = 0;                       ///< of each row
  bool has_more = false;                         ///< rows may have other columns after these
  char delimiter = ',';
};

/// None where rows do not hold points.
std::optional<RowLayout> layout_of(const std::string& path, std::string_view text, const ReadOptions& options) {
  constexpr std::size_t kTelling = 64;  // rows, as the format is recognised by
  std::vector<CsvRecord> records = csv_records(path, text, kTelling);
  const std::optional<char> delimiter = csv_delimiter(path, text);
  if (records.empty() || !delimiter || (options.dimension > 0 && is_one_column(records))) return std::nullopt;
  name_unnamed_columns(records);
  CsvRecord& first = records.front();
  RowLayout layout{.points = {}, .columns = first.fields.size(), .delimiter = *delimiter};
  if (!options.columns.empty()) name_columns(path, first, options.columns);
  const CsvLayout* const other = options.columns.empty() ? find_layout(records) : nullptr;
  if (other != nullptr && other->read == read_shape_rows) {
    layout.points = columns_of_shape_rows(path, first);
    layout.header_line = first.line;
  } else if (other != nullptr && other->read == read_named_shape_rows) {
    const std::size_t dimension = dimension_of_named_shape(path, first);
    for (std::size_t column = 1; column + dimension <= layout.columns; column += dimension) {
      layout.points.emplace_back();
      for (std::size_t axis = 0; axis < dimension; ++axis) layout.points.back().push_back(column + axis);
    }
  } else if (other == nullptr) {
    const bool has_names = options.columns.empty() && holds_named_points(records);
    const bool has_header = !has_names && (is_header(first) || !options.columns.empty());
    const CsvColumns columns = has_header  ? coordinates_of_header(path, first)
                               : has_names ? columns_of_named_points(first)
                                           : columns_without_header(path, first);
    layout.points = {columns.coordinates};
    if (has_header) layout.defined = find_column(first, ColumnRole::kDefined);
    if (has_header) layout.header_line = first.line;
  }
  return layout.points.empty() ? std::nullopt : std::optional(std::move(layout));
}

/// One pass over the rows.
class TablePoints {
 public:
  TablePoints(const std::string& path, const RowLayout& layout, bool negative_is_missing, CarriedFile& file)
      : path_(path),
        layout_(layout),
        negative_is_missing_(negative_is_missing),
        dimension_(layout.points.front().size()),
        file_(file) {}

  void read() {
    const std::string_view text = file_.text();
    const char line_end = text::line_end_of(text);
    bool may_name_delimiter = true;
    for (std::size_t at = text.size() - text::without_byte_order_mark(text).size(); at < text.size(); ++at) {
      ++line_;
      const std::size_t begin = at;
      at = std::min(text.find(line_end, begin), text.size());
      const std::string_view content = text::trim(text.substr(begin, at - begin));
      if (content.empty() || content == "\x1A" || is_csv_comment(content)) continue;
      if (std::exchange(may_name_delimiter, false) && names_csv_delimiter(content)) continue;
      at = csv_spans(text, begin, layout_.delimiter, line_end, fields_);
      if (line_ > layout_.header_line) add_row(at);
      line_ += static_cast<std::size_t>(std::count(text.data() + begin, text.data() + at, line_end));
    }
    use_commas();
    file_.sort_places();
    file_.shape.points = text::points_from(coordinates_, dimension_);
  }

  /// The part of the text up to the end of the first row of points, and how many numbers this row holds.
  std::size_t end_of_first() const { return first_end_; }
  Eigen::Index points_in_first() const { return std::ssize(layout_.points); }

 private:
  void add_row(std::size_t end) {
    const auto is_empty = [](const CsvSpan& field) { return field.begin == field.end; };
    if (std::all_of(fields_.begin(), fields_.end(), is_empty)) return;
    const std::size_t needed = std::min(layout_.columns, fields_.size());
    if (needed < layout_.columns ||
        (!layout_.has_more &&
         !std::all_of(fields_.begin() + static_cast<std::ptrdiff_t>(needed), fields_.end(), is_empty)))
      text::fail(
          path_, line_,
          fmt::format("{}; it needs {}, as all lines", text::counted(fields_.size(), "column"), layout_.columns));
    if (first_end_ == 0) first_end_ = end;
    const bool is_missing = is_undefined();
    for (const std::vector<std::size_t>& columns : layout_.points) add_point(columns, is_missing);
  }

  /// A point that is missing keeps its marks.
  void add_point(const std::vector<std::size_t>& columns, bool is_missing) {
    const std::size_t first = coordinates_.size();
    text::CoordinatePlace place{path_, line_, std::to_string(first / dimension_ + 1), "", 0};
    std::size_t known = 0;
    bool is_negative = false;
    for (const std::size_t column : columns) {
      const double value = number_in(fields_[column], place);
      if (!std::isnan(value)) ++known;
      is_negative |= value < 0;
      coordinates_.push_back(is_missing ? text::kMissing : value);
      ++place.axis;
    }
    if (is_missing || known == 0) return;
    if (negative_is_missing_ && is_negative)
      std::fill(coordinates_.end() - static_cast<std::ptrdiff_t>(dimension_), coordinates_.end(), text::kMissing);
    for (std::size_t axis = 0; axis < dimension_; ++axis) {
      const CsvSpan& field = fields_[columns[axis]];
      file_.add_place(field.begin, field.end - field.begin, static_cast<std::uint32_t>(first + axis));
    }
  }

  std::string_view text_in(const CsvSpan& field) const {
    return std::string_view(file_.text()).substr(field.begin, field.end - field.begin);
  }

  bool is_undefined() const {
    if (!layout_.defined) return false;
    const std::string field = text::to_lower(text_in(fields_[*layout_.defined]));
    return field == "0" || field == "false";
  }

  double number_in(const CsvSpan& field, const text::CoordinatePlace& place) {
    const std::string_view text = text_in(field);
    if (text.find('.') != std::string_view::npos) has_points_ = true;
    if (text.find(',') == std::string_view::npos) return text::parse_coordinate(text, place);
    if (comma_line_ == 0) comma_line_ = line_;
    if (layout_.delimiter != ',' || !may_have_thousands(text)) commas_are_decimal_ = true;
    return text::parse_coordinate(text::with_decimal_point(text), place);
  }

  void use_commas() {
    if (comma_line_ == 0) return;
    if (has_points_ || !commas_are_decimal_)
      text::fail(path_, comma_line_,
                 "a coordinate has a comma, which may be a decimal one or one of thousands; write it with a point");
    file_.use_decimal_commas(layout_.delimiter == ',');
  }

  const std::string& path_;
  const RowLayout& layout_;
  bool negative_is_missing_;
  std::size_t dimension_;
  CarriedFile& file_;
  std::size_t line_ = 0;
  std::size_t first_end_ = 0;
  bool has_points_ = false;
  bool commas_are_decimal_ = false;
  std::size_t comma_line_ = 0;
  std::vector<CsvSpan> fields_;
  std::vector<double> coordinates_;
};

/// Whether both hold the same points, in their order.
bool holds_points(const std::vector<Landmarks>& shapes, const Points& points) {
  Eigen::Index next = 0;
  for (const Landmarks& shape : shapes) {
    if (shape.dimension() != points.rows() || next + shape.points.cols() > points.cols()) return false;
    const auto part = points.middleCols(next, shape.points.cols()).array();
    if (!(part == shape.points.array() || (part.isNaN() && shape.points.array().isNaN())).all()) return false;
    next += shape.points.cols();
  }
  return next == points.cols();
}

std::unique_ptr<CarriedFile> carry_rows(const std::string& path, std::string text, const RowLayout& layout,
                                        const ReadOptions& options, const std::string& format) {
  auto file = std::make_unique<CarriedFile>(std::move(text));
  TablePoints rows(path, layout, options.negative_is_missing, *file);
  rows.read();
  if (rows.end_of_first() == 0) throw InputError(path + " holds a header and no points");
  // Units, axes and frame are those that the reader of the format finds, which has to agree on what a row is.
  ReadOptions of_first = options;
  of_first.format = format;
  LandmarkFile first = shapes_of_text(path, file->text().substr(0, rows.end_of_first()), of_first);
  if (!holds_points(first.shapes, file->shape.points.leftCols(rows.points_in_first()))) return nullptr;
  file->shape.units = first.units;
  file->shape.axes = first.axes;
  file->shape.frame = first.shapes.front().frame;
  file->shape.source = path;
  return file;
}

/// The columns of x, y and perhaps z that the row `coords` of DeepLabCut names, beside those of the likelihood.
std::optional<RowLayout> deeplabcut_layout(const std::string& path, std::string_view text) {
  constexpr std::size_t kHead = 5;  // scorer, perhaps individuals, bodyparts, coords, and a row
  const std::vector<CsvRecord> records = csv_records(path, text, kHead);
  const auto coords = std::find_if(records.begin(), records.end(),
                                   [](const CsvRecord& record) { return record.fields.front() == "coords"; });
  const std::optional<char> delimiter = csv_delimiter(path, text);
  if (coords == records.end() || !delimiter) return std::nullopt;
  const std::vector<std::string>& names = coords->fields;
  RowLayout layout{.points = {}, .header_line = coords->line, .columns = names.size(), .delimiter = *delimiter};
  for (std::size_t i = 0; i + 1 < names.size(); ++i) {
    if (names[i] != "x" || names[i + 1] != "y") continue;
    layout.points.push_back({i, i + 1});
    if (i + 2 < names.size() && names[i + 2] == "z") layout.points.back().push_back(i + 2);
  }
  return layout.points.empty() ? std::nullopt : std::optional(std::move(layout));
}

}  // namespace

std::unique_ptr<CarriedFile> carry_deeplabcut(const std::string& path, std::string text, const ReadOptions& options) {
  const std::optional<RowLayout> layout = deeplabcut_layout(path, text);
  return layout ? carry_rows(path, std::move(text), *layout, options, "deeplabcut") : nullptr;
}

std::unique_ptr<CarriedFile> carry_table(const std::string& path, std::string text, const ReadOptions& options) {
  const std::optional<RowLayout> layout = layout_of(path, text, options);
  return layout ? carry_rows(path, std::move(text), *layout, options, "csv") : nullptr;
}

std::unique_ptr<CarriedFile> carry_fcsv(const std::string& path, std::string text, const ReadOptions& options) {
  RowLayout layout{.points = {fcsv_coordinates(path, text)}, .has_more = true, .delimiter = ','};
  layout.columns = *std::max_element(layout.points.front().begin(), layout.points.front().end()) + 1;
  return carry_rows(path, std::move(text), layout, options, "fcsv");
}

}  // namespace pulson::formats
