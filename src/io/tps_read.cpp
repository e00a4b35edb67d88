#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "formats.hpp"
#include "pulson/core/errors.hpp"
#include "text.hpp"

namespace pulson::io {
namespace {

/// A line `KEY = value`.
struct KeyLine {
  std::string key;  // lower case
  std::string_view value;
};

std::optional<KeyLine> parse_key_line(std::string_view line) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return std::nullopt;
  return KeyLine{to_lower(trim(line.substr(0, equals))), trim(line.substr(equals + 1))};
}

bool is_shape_key(const std::string& key) { return key == "lm" || key == "lm3"; }

/// `C:\photos\fish 1.jpg` → `fish 1`
std::string_view image_stem(std::string_view image) {
  image.remove_prefix(image.find_last_of("/\\") + 1);
  return image.substr(0, image.rfind('.'));
}

/// One pass over the lines of a file.
class TpsReader {
 public:
  TpsReader(const std::string& path, std::string_view text) : path_(path), lines_(split_lines(path, text)) {
    std::erase_if(lines_, [](const TextLine& line) { return trim(line.text).empty(); });
  }

  LandmarkFile read() {
    if (lines_.empty()) throw InputError(path_ + " holds only blank lines; a tps file begins with LM= or LM3=");
    while (next_ < lines_.size()) read_keyword();
    note_unused();
    return std::move(file_);
  }

 private:
  const TextLine& line() const { return lines_[next_]; }

  void read_keyword() {
    const std::optional<KeyLine> entry = parse_key_line(line().text);
    if (!entry) fail_without_keyword();
    if (is_shape_key(entry->key)) return read_shape(*entry);
    if (file_.shapes.empty())
      fail(path_, line().number, in_quotes(trim(line().text)) + " stands before the first LM= or LM3=");
    if (entry->key == "points") return skip_points(*entry);
    read_property(*entry);
    ++next_;
  }

  void read_property(const KeyLine& entry) {
    std::string& name = file_.shapes.back().name;
    if (entry.key == "id" && !entry.value.empty()) name = entry.value;
    if (entry.key == "image" && name.empty()) name = image_stem(entry.value);
    if (entry.key == "scale") ++scales_;
    if (entry.key == "curves") curves_ += parse_count(entry);
    if (entry.key == "outlines") outlines_ += parse_count(entry);
  }

  void read_shape(const KeyLine& entry) {
    const Eigen::Index d = entry.key == "lm3" ? 3 : 2;
    std::vector<double> coordinates;
    const std::size_t count = read_points(entry, static_cast<std::size_t>(d), &coordinates, file_.shapes.size() + 1);
    file_.shapes.emplace_back().points = Points::Map(coordinates.data(), d, static_cast<Eigen::Index>(count));
  }

  void skip_points(const KeyLine& entry) { points_ += read_points(entry, 0, nullptr, file_.shapes.size()); }

  /// Reads the lines that `entry` (LM=n, POINTS=n) announces, and their `d` numbers each unless `coordinates` is null.
  std::size_t read_points(const KeyLine& entry, std::size_t d, std::vector<double>* coordinates, std::size_t shape) {
    const std::size_t count = parse_count(entry);
    const TextLine announcement = lines_[next_++];
    for (std::size_t i = 1; i <= count; ++i, ++next_) {
      if (next_ == lines_.size() || line().text.find('=') != std::string_view::npos)
        fail_truncated(announcement, shape, i - 1);
      if (coordinates == nullptr) continue;
      CoordinatePlace place{path_, line().number, std::to_string(i), "shape " + std::to_string(shape), 0};
      read_point(d, place, *coordinates);
    }
    return count;
  }

  void read_point(std::size_t d, CoordinatePlace& place, std::vector<double>& coordinates) const {
    const std::vector<std::string_view> words = split_words(line().text);
    if (words.size() != d)
      fail(path_, line().number,
           fmt::format("landmark {} of {} has {} ({}); {} takes {}", place.landmark, place.shape,
                       counted(words.size(), "column"), in_quotes(trim(line().text)), d == 2 ? "LM=" : "LM3=", d));
    for (; place.axis < d; ++place.axis) coordinates.push_back(parse_coordinate(words[place.axis], place));
  }

  std::size_t parse_count(const KeyLine& entry) const {
    std::size_t count = 0;
    const char* const end = entry.value.data() + entry.value.size();
    const auto [stop, error] = std::from_chars(entry.value.data(), end, count);
    if (error != std::errc() || stop != end)
      fail(path_, line().number, in_quotes(trim(line().text)) + " needs a whole number, not negative, after '='");
    return count;
  }

  [[noreturn]] void fail_truncated(const TextLine& announcement, std::size_t shape, std::size_t found) const {
    const std::string stopped_at = next_ == lines_.size()
                                       ? "the file ends"
                                       : fmt::format("line {} is {}", line().number, in_quotes(trim(line().text)));
    fail(path_, announcement.number,
         fmt::format("shape {} says {} but has {} before {}", shape, in_quotes(trim(announcement.text)),
                     counted(found, "line") + " of coordinates", stopped_at));
  }

  [[noreturn]] void fail_without_keyword() const {
    const std::string found = in_quotes(trim(line().text));
    if (file_.shapes.empty()) fail(path_, line().number, found + "; a tps file begins with LM= or LM3=");
    fail(path_, line().number,
         fmt::format("{} after the {} that shape {} announces; a keyword such as ID= or LM= is right here", found,
                     counted(static_cast<std::size_t>(file_.shapes.back().count()), "landmark"), file_.shapes.size()));
  }

  void note_unused() {
    const auto warn = [this](const std::string& message) { file_.warnings.push_back(path_ + ": " + message); };
    if (scales_ > 0)
      warn(fmt::format("SCALE is recorded ({} of {}) and not applied to the coordinates", scales_,
                       counted(file_.shapes.size(), "shape")));
    if (curves_ + outlines_ + points_ > 0)
      warn(fmt::format("{} and {} ({}) are not used", counted(curves_, "curve"), counted(outlines_, "outline"),
                       counted(points_, "point")));
    if (const std::size_t marks = count_missing_marks(); marks > 0)
      warn(counted(marks, "landmark") +
           " at (-1, -1), often the mark of a missing one, read as a point like any other");
  }

  /// Landmarks at (−1, −1) in a file that has no other negative coordinate.
  std::size_t count_missing_marks() const {
    std::size_t marks = 0;
    for (const Landmarks& shape : file_.shapes)
      for (const auto& point : shape.points.colwise()) {
        if (point.hasNaN() || (point.array() >= 0).all()) continue;
        if ((point.array() != -1).any()) return 0;
        ++marks;
      }
    return marks;
  }

  const std::string& path_;
  std::vector<TextLine> lines_;
  std::size_t next_ = 0;
  LandmarkFile file_;
  std::size_t scales_ = 0;
  std::size_t curves_ = 0;
  std::size_t outlines_ = 0;
  std::size_t points_ = 0;
};

}  // namespace

bool sniff_tps(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (begin == std::string_view::npos) return false;
  text.remove_prefix(begin);
  const std::optional<KeyLine> entry = parse_key_line(text.substr(0, text.find_first_of("\r\n")));
  return entry && is_shape_key(entry->key);
}

LandmarkFile read_tps(const std::string& path, std::string_view text) { return TpsReader(path, text).read(); }

}  // namespace pulson::io
