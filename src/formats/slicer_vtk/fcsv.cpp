// Point lists of 3D Slicer as tables: comments `# key = value`, then one line for each landmark.

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kColumns = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";
constexpr std::string_view kColumnsOfSlicer3 = "label,x,y,z,sel,vis";
constexpr std::size_t kNoColumn = std::numeric_limits<std::size_t>::max();

/// What a line is but for the quotes that spreadsheets put around comments with commas.
std::string_view without_quote(std::string_view line) {
  line = text::trim(line);
  return line.starts_with("\"#") ? line.substr(1) : line;
}

bool is_fcsv_comment(std::string_view line) { return without_quote(line).starts_with('#'); }

/// The fields of a line, which may be in quotes; a quote in them is doubled.
std::vector<std::string> split_fields(const std::string& path, const text::TextLine& line, char delimiter) {
  std::vector<std::string> fields(1);
  bool in_quote = false;
  for (std::size_t i = 0; i < line.text.size(); ++i) {
    const char c = line.text[i];
    if (c == '"' && in_quote && i + 1 < line.text.size() && line.text[i + 1] == '"')
      fields.back() += line.text[++i];
    else if (c == '"' && (in_quote || text::trim(fields.back()).empty()))
      in_quote = !in_quote;
    else if (c == delimiter && !in_quote)
      fields.emplace_back();
    else
      fields.back() += c;
  }
  if (in_quote) text::fail(path, line.number, "a quotation mark is not closed");
  return fields;
}

/// How often a character stands outside quotes.
std::ptrdiff_t count_unquoted(std::string_view line, char wanted) {
  bool in_quote = false;
  std::ptrdiff_t count = 0;
  for (const char c : line) {
    if (c == '"') in_quote = !in_quote;
    if (c == wanted && !in_quote) ++count;
  }
  return count;
}

/// What is between the columns: commas or, in copies of spreadsheets, semicolons or tabs.
char find_fcsv_delimiter(const std::vector<text::TextLine>& lines) {
  for (const text::TextLine& line : lines) {
    if (is_fcsv_comment(line.text) || text::trim(line.text).empty()) continue;
    for (const char delimiter : {';', '\t'})
      if (count_unquoted(line.text, delimiter) >= 3) return delimiter;
    return ',';
  }
  return ',';
}

/// `1. mai`, `may-01`, `01.05.2019`: what a spreadsheet makes of 1.5.
bool looks_like_date(std::string_view field) {
  constexpr std::array<std::string_view, 16> kMonths = {"jan", "feb", "mar", "m\xC3\xA4r", "mrz", "apr", "may", "mai",
                                                        "jun", "jul", "aug", "sep",        "oct", "okt", "nov", "dez"};
  if (field.find_first_of("0123456789") == std::string_view::npos || text::is_number(field)) return false;
  const auto is_in = [&](std::string_view month) { return field.find(month) != std::string_view::npos; };
  return std::any_of(kMonths.begin(), kMonths.end(), is_in) || is_in("dec") || is_in("/") ||
         std::count(field.begin(), field.end(), '.') == 2 || std::count(field.begin(), field.end(), ':') > 0;
}

/// One pass over the lines of a file.
class FcsvReader {
 public:
  FcsvReader(const std::string& path, std::string_view text) : path_(path), lines_(text::split_lines(path, text)) {
    file_.units = "mm";
    delimiter_ = find_fcsv_delimiter(lines_);
  }

  LandmarkFile read() {
    for (const text::TextLine& line : lines_) {
      if (is_fcsv_comment(line.text))
        read_comment(line);
      else if (!text::trim(line.text).empty())
        read_landmark(line);
    }
    if (!has_version_ && !has_axes_) file_.axes = "RAS";  // as Slicer takes files of its version 3
    Landmarks& shape = file_.shapes.emplace_back();
    shape.points = text::points_from(coordinates_, 3);
    shape.labels = text::unless_all_empty(std::move(labels_));
    return std::move(file_);
  }

  const std::vector<std::size_t>& coordinates() const { return axes_; }

 private:
  void read_comment(const text::TextLine& line) {
    std::string_view comment = without_quote(line.text).substr(1);
    // spreadsheets add separators, and quotes
    comment = text::trim(comment.substr(0, comment.find_last_not_of(",;\" \t") + 1));
    const std::size_t equals = comment.find('=');
    if (equals == std::string_view::npos) return;
    const std::string key = text::to_lower(text::trim(comment.substr(0, equals)));
    const std::string_view value = text::trim(comment.substr(equals + 1));
    if (key == "markups fiducial file version") has_version_ = true;
    if (key == "coordinatesystem") read_axes(line, value);
    if (key == "columns") use_columns({line.number, value});
  }

  void read_axes(const text::TextLine& line, std::string_view value) {
    const std::string word = text::to_lower(value);
    has_axes_ = true;
    file_.units = "mm";
    if (word == "0" || word == "ras") {
      file_.axes = "RAS";
    } else if (word == "1" || word == "lps") {
      file_.axes = "LPS";
    } else if (word == "2" || word == "ijk") {
      file_.units = "voxels";
      file_.warnings.push_back(path_ +
                               ": the coordinates are indices (IJK) of an image's voxels, with no unit of length");
    } else {
      text::fail(path_, line.number,
                 fmt::format("CoordinateSystem is {}; RAS, LPS, IJK or 0, 1, 2 is expected", text::in_quotes(value)));
    }
  }

  void use_columns(const text::TextLine& line) {
    // a spreadsheet may separate the columns otherwise than this line, which is one of its cells
    const bool is_as_written = line.text.find(delimiter_) == std::string_view::npos;
    std::vector<std::string> names = split_fields(path_, line, is_as_written ? ',' : delimiter_);
    for (std::string& name : names) name = text::to_lower(text::trim(name));
    const auto place_of = [&](std::string_view name) {
      const auto found = std::find(names.begin(), names.end(), name);
      return found == names.end() ? kNoColumn : static_cast<std::size_t>(found - names.begin());
    };
    axes_ = {place_of("x"), place_of("y"), place_of("z")};
    columns_ = names.size();
    label_ = place_of("label");
    if (label_ == kNoColumn) label_ = place_of("name");
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (axes_[axis] == kNoColumn)
        text::fail(path_, line.number, fmt::format("no column '{}' in {}", "xyz"[axis], text::in_quotes(line.text)));
  }

  void read_landmark(const text::TextLine& line) {
    const std::vector<std::string> fields = split_fields(path_, line, delimiter_);
    if (axes_.empty()) use_columns({0, has_version_ || fields.size() > 6 ? kColumns : kColumnsOfSlicer3});
    const std::size_t needed = std::max({axes_[0], axes_[1], axes_[2]}) + 1;
    const std::size_t number = labels_.size() + 1;
    if (fields.size() < needed)
      text::fail(
          path_, line.number,
          fmt::format("landmark {} has {}; {} are needed", number, text::counted(fields.size(), "column"), needed));
    labels_.push_back(label_ < fields.size() ? std::string(text::trim(fields[label_])) : "");
    text::CoordinatePlace place{path_, line.number, std::to_string(number), "", 0};
    const bool is_placed = is_defined(fields);
    for (; place.axis < 3; ++place.axis) {
      const double value = parse_field(text::trim(fields[axes_[place.axis]]), place);
      coordinates_.push_back(is_placed ? value : text::kMissing);
    }
  }

  /// Slicer 5 writes two columns more than the header names, the first of which is the status of the position:
  /// 0 undefined, 1 preview, 2 defined, 3 missing.
  bool is_defined(const std::vector<std::string>& fields) const {
    if (fields.size() != columns_ + 2) return true;
    const std::string_view status = text::trim(fields[columns_]);
    return status != "0" && status != "1" && status != "3";
  }

  /// With a decimal comma too, as spreadsheets write it. @throws InputError, which says so of what one made a date
  static double parse_field(std::string_view field, const text::CoordinatePlace& place) {
    const std::string number = text::with_decimal_point(field);
    if (looks_like_date(text::to_lower(number)))
      text::fail(place.path, place.line,
                 fmt::format("landmark {}: {} is {}, as a spreadsheet writes a number that it took for a date; use the "
                             "file as Slicer wrote it",
                             place.landmark, text::kAxisLetters[place.axis], text::in_quotes(field)));
    return text::parse_coordinate(number, place);
  }

  const std::string& path_;
  std::vector<text::TextLine> lines_;
  LandmarkFile file_;
  bool has_version_ = false;  // of Markups, from Slicer 4 on
  bool has_axes_ = false;
  std::vector<std::size_t> axes_;  // columns of x, y, z; none before they are known
  std::size_t label_ = kNoColumn;
  std::size_t columns_ = kNoColumn;  // that the header names
  char delimiter_ = ',';
  std::vector<double> coordinates_;
  std::vector<std::string> labels_;
};

std::string quoted_where_needed(const std::string& label) {
  return label.find_first_of(",;\t\"") == std::string::npos ? label : text::csv_quoted(label);
}

bool sniff_fcsv(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n\xEF\xBB\xBF"), text.size()));
  while (text.starts_with('#') || text.starts_with("\"#")) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string line = text::to_lower(text.substr(0, end));
    for (const std::string_view mark : {"markups fiducial file", "fiducial list file", "coordinatesystem ="})
      if (line.find(mark) != std::string::npos) return true;
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n", end), text.size()));
  }
  return false;
}

LandmarkFile read_fcsv(const std::string& path, std::string_view text) { return FcsvReader(path, text).read(); }

WrittenLandmarks write_fcsv(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "fcsv"};
  const Landmarks& shape = require_one_shape(target, file);
  require_complete(target, shape);
  const bool knows_axes = file.axes.empty() || file.axes == "LPS" || file.axes == "RAS";
  const bool knows_units = file.units.empty() || file.units == "mm";
  WrittenLandmarks written;
  written.losses = losses_of(target, file, {.labels = true, .units = true, .axes = knows_axes});
  if (!knows_units)
    written.losses.push_back(cannot_hold(target, "the units " + text::in_quotes(file.units)) +
                             "; the numbers will be read as mm");
  const Points points = points_in_space(target, shape, written.losses);
  written.text = fmt::format("# Markups fiducial file version = 4.11\n# CoordinateSystem = {}\n# columns = {}\n",
                             file.axes == "RAS" ? "RAS" : "LPS", kColumns);
  bool is_changed = false;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const std::string label =
        shape.labels.empty() ? "" : one_line(shape.labels[static_cast<std::size_t>(i)], is_changed);
    fmt::format_to(std::back_inserter(written.text), "{},{},{},{},0,0,0,1,1,1,0,{},,\n", i + 1, points(0, i),
                   points(1, i), points(2, i), quoted_where_needed(label));
  }
  if (is_changed) written.losses.push_back(cannot_hold_breaks(target));
  return written;
}

}  // namespace

std::vector<std::size_t> fcsv_coordinates(const std::string& path, std::string_view text) {
  FcsvReader reader(path, text);
  reader.read();
  return reader.coordinates().empty() ? std::vector<std::size_t>{1, 2, 3} : reader.coordinates();
}

LandmarkFormat fcsv_format() {
  return {.name = "fcsv",
          .extensions = {"fcsv"},
          .help =
              "3D Slicer point list as a table, versions 3 (which is in RAS) and 4, RAS or LPS: x, y, z and label; one "
              "shape",
          .sniff = sniff_fcsv,
          .read = read_fcsv,
          .write = write_fcsv};
}

}  // namespace pulson::formats
