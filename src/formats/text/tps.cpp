#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "formats/shape_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "text_lines.hpp"

namespace pulson::formats {

namespace {

/// A line `KEY = value`.
struct KeyLine {
  std::string_view name;  // as it stands
  std::string key;        // lower case
  std::string_view value;
};

std::optional<KeyLine> parse_key_line(std::string_view line) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return std::nullopt;
  const std::string_view name = text::trim(line.substr(0, equals));
  return KeyLine{name, text::to_lower(name), text::trim(line.substr(equals + 1))};
}

bool is_blank_or_comment(std::string_view line) {
  const std::string_view text = text::trim(line);
  return text.empty() || is_tps_comment(text);
}

bool is_shape_key(const std::string& key) { return key == "lm" || key == "lm3"; }

/// The points of one shape's curves or outlines, and how many it announces.
struct TpsLines {
  std::vector<Points> Landmarks::*points;
  std::size_t announced = 0;
  text::TextLine announcement{0, {}};
};

/// One pass over the lines of a file.
class TpsReader {
 public:
  TpsReader(const std::string& path, std::string_view text) : path_(path), lines_(text::split_lines(path, text)) {
    std::erase_if(lines_, [](const text::TextLine& line) { return is_blank_or_comment(line.text); });
  }

  LandmarkFile read() {
    if (lines_.empty()) throw InputError(path_ + " holds only blank lines; a tps file begins with LM= or LM3=");
    while (next_ < lines_.size()) read_keyword();
    finish_shape();
    note_unused();
    return std::move(file_);
  }

 private:
  const text::TextLine& line() const { return lines_[next_]; }

  void read_keyword() {
    const std::optional<KeyLine> entry = parse_key_line(line().text);
    if (!entry) fail_without_keyword();
    if (is_shape_key(entry->key)) return read_shape(*entry);
    if (file_.shapes.empty())
      text::fail(path_, line().number, text::in_quotes(text::trim(line().text)) + " is before the first LM= or LM3=");
    if (entry->key == "points") return read_line_points(*entry);
    read_property(*entry);
    ++next_;
  }

  void read_property(const KeyLine& entry) {
    Landmarks& shape = file_.shapes.back();
    if (entry.key == "id") {
      if (!entry.value.empty()) shape.name = entry.value;
    } else if (entry.key == "image") {
      shape.image = entry.value;
      if (shape.name.empty()) shape.name = text::image_stem(entry.value);
    } else if (entry.key == "curves") {
      announce(curves_, entry);
    } else if (entry.key == "outlines") {
      announce(outlines_, entry);
    } else if (entry.key == "scale" && entry.value.empty()) {
      return;
    } else if (const auto scale = parse_scale(entry)) {
      shape.scale = *scale;
    } else {
      shape.properties.emplace_back(entry.name, entry.value);
    }
  }

  static std::optional<double> parse_scale(const KeyLine& entry) {
    const std::string number = text::with_decimal_point(entry.value);
    if (entry.key != "scale" || !text::is_number(number)) return std::nullopt;
    const double scale = parse_number(number, "");
    return std::isfinite(scale) ? std::optional(scale) : std::nullopt;
  }

  void announce(TpsLines& lines, const KeyLine& entry) {
    lines.announced += parse_count(entry);
    lines.announcement = line();
    reads_outlines_ = &lines == &outlines_;
  }

  void read_shape(const KeyLine& entry) {
    finish_shape();
    dimension_ = entry.key == "lm3" ? 3 : 2;
    const std::string shape = fmt::format("shape {}", file_.shapes.size() + 1);
    Points points = read_points(entry, shape, shape);
    file_.shapes.emplace_back().points = std::move(points);
  }

  void read_line_points(const KeyLine& entry) {
    std::vector<Points>& lines = file_.shapes.back().*(reads_outlines_ ? outlines_ : curves_).points;
    const std::string shape = fmt::format("shape {}", file_.shapes.size());
    const std::string kind = reads_outlines_ ? "outline" : "curve";
    lines.push_back(read_points(entry, shape, fmt::format("{} {} of {}", kind, lines.size() + 1, shape)));
  }

  /// The shape is complete: checks its curves and outlines, which are its landmarks where it has no others.
  void finish_shape() {
    if (file_.shapes.empty()) return;
    Landmarks& shape = file_.shapes.back();
    for (TpsLines* lines : {&curves_, &outlines_}) {
      const std::size_t found = (shape.*lines->points).size();
      if (found != lines->announced) note_uncounted(shape, *lines, found);
      lines->announced = 0;
    }
    reads_outlines_ = false;
    if (take_lines_as_landmarks(shape)) ++shapes_of_lines_;
  }

  /// Reads the lines of coordinates that `entry` (LM=n, POINTS=n) announces; `owner` is whose messages say they are.
  Points read_points(const KeyLine& entry, const std::string& shape, const std::string& owner) {
    const std::size_t count = parse_count(entry);
    const text::TextLine announcement = lines_[next_++];
    std::vector<double> coordinates;
    for (std::size_t i = 1; i <= count; ++i, ++next_) {
      if (next_ == lines_.size() || line().text.find('=') != std::string_view::npos)
        fail_truncated(announcement, shape, i - 1);
      text::CoordinatePlace place{path_, line().number, std::to_string(i), owner, 0};
      read_point(place, coordinates);
    }
    return text::points_from(coordinates, static_cast<std::size_t>(dimension_));
  }

  void read_point(text::CoordinatePlace& place, std::vector<double>& coordinates) const {
    const std::vector<std::string_view> words = text::split_words(line().text);
    const auto d = static_cast<std::size_t>(dimension_);
    if (words.size() != d)
      text::fail(path_, line().number,
                 fmt::format("landmark {} of {} has {} ({}); {} takes {}", place.landmark, place.shape,
                             text::counted(words.size(), "column"), text::in_quotes(text::trim(line().text)),
                             d == 2 ? "LM=" : "LM3=", d));
    for (; place.axis < d; ++place.axis)
      coordinates.push_back(text::parse_coordinate(text::with_decimal_point(words[place.axis]), place));
  }

  std::size_t parse_count(const KeyLine& entry) const {
    const std::optional<std::size_t> count = formats::parse_count(entry.value);
    if (!count)
      text::fail(path_, line().number,
                 text::in_quotes(text::trim(line().text)) + " needs a whole number, not negative, after '='");
    return *count;
  }

  /// Refused where the curves are the landmarks, else noted.
  void note_uncounted(const Landmarks& shape, const TpsLines& lines, std::size_t found) {
    const std::size_t number = file_.shapes.size();
    const bool is_announced = lines.announced > 0;
    const std::size_t line = is_announced ? lines.announcement.number : lines_[next_ - 1].number;
    const std::string lists = text::counted(found, "list");
    const std::string difference =
        is_announced ? fmt::format("shape {} says {} but has {} of POINTS=", number,
                                   text::in_quotes(text::trim(lines.announcement.text)), lists)
                     : fmt::format("shape {} has {} of POINTS= that no CURVES= or OUTLINES= announces", number, lists);
    if (shape.count() == 0) text::fail(path_, line, difference);
    if (uncounted_++ == 0) first_uncounted_ = fmt::format("{}:{}: {}", path_, line, difference);
  }

  [[noreturn]] void fail_truncated(const text::TextLine& announcement, const std::string& shape,
                                   std::size_t found) const {
    const std::string stopped_at =
        next_ == lines_.size() ? "the file ends"
                               : fmt::format("line {} is {}", line().number, text::in_quotes(text::trim(line().text)));
    text::fail(path_, announcement.number,
               fmt::format("{} says {} but has {} before {}", shape, text::in_quotes(text::trim(announcement.text)),
                           text::counted(found, "line") + " of coordinates", stopped_at));
  }

  [[noreturn]] void fail_without_keyword() const {
    const std::string found = text::in_quotes(text::trim(line().text));
    if (file_.shapes.empty()) text::fail(path_, line().number, found + "; a tps file begins with LM= or LM3=");
    text::fail(path_, line().number,
               fmt::format("{} after the {} that shape {} announces; a keyword such as ID= or LM= is expected here",
                           found, text::counted(static_cast<std::size_t>(file_.shapes.back().count()), "landmark"),
                           file_.shapes.size()));
  }

  void note_unused() {
    const auto warn = [this](const std::string& message) { file_.warnings.push_back(path_ + ": " + message); };
    if (uncounted_ > 0)
      file_.warnings.push_back(first_uncounted_ + "; the landmarks and the curves present are read" +
                               (uncounted_ > 1 ? fmt::format(" ({} more likewise)", uncounted_ - 1) : ""));
    for (const std::string& note : {note_of_scales(file_.shapes), note_of_curves(file_.shapes)})
      if (!note.empty()) warn(note);
    if (shapes_of_lines_ > 0) warn(taken_as_landmarks(shapes_of_lines_));
  }

  const std::string& path_;
  std::vector<text::TextLine> lines_;
  std::size_t next_ = 0;
  LandmarkFile file_;
  Eigen::Index dimension_ = 2;  // of the shape
  TpsLines curves_{&Landmarks::curves};
  TpsLines outlines_{&Landmarks::outlines};
  bool reads_outlines_ = false;  // whether the next POINTS= are those of an outline
  std::size_t shapes_of_lines_ = 0;
  std::size_t uncounted_ = 0;    // numbers of curves or outlines that are not those announced
  std::string first_uncounted_;  // the first of them
};

bool sniff_tps(std::string_view text) {
  constexpr std::size_t kMostComments = 100;
  for (const std::string_view line : first_lines(text, kMostComments)) {
    if (is_blank_or_comment(line)) continue;
    const std::optional<KeyLine> entry = parse_key_line(line);
    return entry && is_shape_key(entry->key);
  }
  return false;
}

LandmarkFile read_tps(const std::string& path, std::string_view text) { return TpsReader(path, text).read(); }

constexpr std::array<std::string_view, 8> kKeywords = {"lm",    "lm3",    "id",       "image",
                                                       "scale", "curves", "outlines", "points"};

class TpsWriter {
 public:
  TpsWriter(const std::string& path, const LandmarkFile& file) : target_{path, "tps"}, file_(file) {}

  WrittenLandmarks write() {
    require_shapes(target_, file_);
    written_.losses = losses_of(
        target_, file_,
        {.names = true, .images = true, .scales = true, .properties = true, .lines = true, .directions = true});
    for (const Landmarks& shape : file_.shapes) write_shape(shape);
    if (has_broken_lines_) written_.losses.push_back(cannot_hold_breaks(target_));
    if (has_unreadable_names_)
      written_.losses.push_back(
          cannot_hold(target_, "properties whose names are empty, hold '=', or are keywords or comments of tps"));
    if (shapes_of_lines_ > 0)
      written_.losses.push_back(cannot_hold(target_, "curves and outlines of a shape without landmarks",
                                            shapes_of_lines_, file_.shapes.size()));
    return std::move(written_);
  }

 private:
  void write_shape(const Landmarks& shape) {
    require_plane_or_space(target_, shape);
    written_.text += fmt::format("{}={}\n", shape.dimension() == 3 ? "LM3" : "LM", shape.count());
    append_points(written_.text, shape.points, "NA");
    if (shape.count() == 0 && !(shape.curves.empty() && shape.outlines.empty())) ++shapes_of_lines_;
    write_lines("CURVES", shape, shape.curves);
    write_lines("OUTLINES", shape, shape.outlines);
    if (!shape.image.empty()) write_text("IMAGE", shape.image);
    if (!shape.name.empty()) write_text("ID", shape.name);
    for (const auto& [name, value] : shape.properties) write_property(name, value);
    if (shape.scale) written_.text += fmt::format("SCALE={}\n", *shape.scale);
  }

  void write_lines(std::string_view keyword, const Landmarks& shape, const std::vector<Points>& lines) {
    if (lines.empty()) return;
    written_.text += fmt::format("{}={}\n", keyword, lines.size());
    for (const Points& points : lines) {
      if (points.rows() != shape.points.rows())
        throw InputError(
            fmt::format("{}: tps holds curves and outlines of the dimension of the landmarks, which are "
                        "in {}D; here is one in {}D",
                        target_.path, shape.dimension(), points.rows()));
      written_.text += fmt::format("POINTS={}\n", points.cols());
      append_points(written_.text, points, "NA");
    }
  }

  /// Whether a line `name=`, without blanks around the name, is read as a property of this name.
  static bool is_readable(const std::string& name) {
    const bool is_keyword = std::find(kKeywords.begin(), kKeywords.end(), text::to_lower(name)) != kKeywords.end();
    return !is_keyword && !name.empty() && name.find('=') == std::string::npos && !is_tps_comment(name);
  }

  void write_property(const std::string& name, const std::string& value) {
    const std::string plain = one_line(name, has_broken_lines_);
    if (is_readable(plain))
      write_text(plain, value);
    else
      has_unreadable_names_ = true;
  }

  void write_text(std::string_view keyword, const std::string& value) {
    written_.text += fmt::format("{}={}\n", keyword, one_line(value, has_broken_lines_));
  }

  Target target_;
  const LandmarkFile& file_;
  WrittenLandmarks written_;
  bool has_broken_lines_ = false;
  bool has_unreadable_names_ = false;
  std::size_t shapes_of_lines_ = 0;
};

WrittenLandmarks write_tps(const std::string& path, const LandmarkFile& file) { return TpsWriter(path, file).write(); }

}  // namespace

LandmarkFormat tps_format() {
  return {.name = "tps",
          .extensions = {"tps"},
          .help = "tpsDig text: LM= or LM3=, coordinates, ID=, IMAGE=, SCALE=, CURVES=, OUTLINES=; several shapes",
          .sniff = sniff_tps,
          .read = read_tps,
          .write = write_tps,
          .y_down = false};
}

}  // namespace pulson::formats
