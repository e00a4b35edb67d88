// Landmarks of dlib in XML, as imglab writes them: images with boxes, and in each box parts with a name and a place in
// pixels, y downwards. Each box is a shape.

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::formats {
namespace {

struct Tag {
  std::size_t line;
  std::string name;
  std::map<std::string, std::string> attributes;
  bool begins = true;  // an element
  bool ends = false;
};

constexpr std::string_view kXmlBlanks = " \t\r\n";

/// `text` with characters for the references that XML has names for.
std::string without_references(std::string_view text) {
  static const std::map<std::string_view, char> kNamed = {
      {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string plain;
  while (!text.empty()) {
    const auto found = text.front() != '&' ? kNamed.end() : kNamed.find(text.substr(0, text.find(';') + 1));
    plain += found == kNamed.end() ? text.front() : found->second;
    text.remove_prefix(found == kNamed.end() ? 1 : found->first.size());
  }
  return plain;
}

/// Takes the tags of a file from its front; text between them is left out, but for what `text` returns.
class Tags {
 public:
  Tags(const std::string& path, std::string_view text) : path_(path), left_(io::without_byte_order_mark(text)) {
    line_end_ = io::line_end_of(text);
  }

  /// The next tag; nothing at the end.
  std::optional<Tag> take() {
    for (;;) {
      const std::size_t begin = left_.find('<');
      text_ = left_.substr(0, begin);
      if (begin == std::string_view::npos) return std::nullopt;
      skip(begin);
      if (left_.starts_with("<!--")) {
        skip_past("-->", "a comment");
      } else if (left_.starts_with("<?")) {
        skip_past("?>", "a declaration");
      } else if (left_.starts_with("<!")) {
        skip_past(">", "a declaration");
      } else {
        return take_tag();
      }
    }
  }

  /// What stood before the last tag, without blanks around it.
  std::string text() const {
    const std::size_t begin = text_.find_first_not_of(kXmlBlanks);
    if (begin == std::string_view::npos) return {};
    return without_references(text_.substr(begin, text_.find_last_not_of(kXmlBlanks) - begin + 1));
  }

  std::size_t line() const { return line_; }

 private:
  void skip(std::size_t count) {
    const auto end = left_.begin() + static_cast<std::ptrdiff_t>(count);
    line_ += static_cast<std::size_t>(std::count(left_.begin(), end, line_end_));
    left_.remove_prefix(count);
  }

  void skip_past(std::string_view end, std::string_view what) {
    const std::size_t found = left_.find(end);
    if (found == std::string_view::npos) io::fail(path_, line_, fmt::format("{} has no '{}'", what, end));
    skip(found + end.size());
  }

  void skip_blanks() { skip(std::min(left_.find_first_not_of(kXmlBlanks), left_.size())); }

  Tag take_tag() {
    Tag tag{line_, {}, {}};
    skip(1);
    if (left_.starts_with('/')) {
      tag.begins = false;
      tag.ends = true;
      skip(1);
    }
    const std::size_t name_end = std::min(left_.find_first_of(" \t\r\n/>="), left_.size());
    tag.name = left_.substr(0, name_end);
    skip(name_end);
    for (skip_blanks(); !left_.starts_with('>') && !left_.starts_with("/>"); skip_blanks()) take_attribute(tag);
    tag.ends = tag.ends || left_.starts_with('/');
    skip_past(">", "a tag");
    return tag;
  }

  /// `name='00'`, with quotes of either kind
  void take_attribute(Tag& tag) {
    const std::size_t equals = left_.find('=');
    const std::string_view name = left_.substr(0, std::min(left_.find_first_of(" \t\r\n=<>"), left_.size()));
    if (equals == std::string_view::npos || name.empty()) fail_attribute(tag);
    const std::size_t quote = left_.find_first_not_of(kXmlBlanks, equals + 1);
    if (left_.substr(name.size(), equals - name.size()).find_first_not_of(kXmlBlanks) != std::string_view::npos ||
        quote == std::string_view::npos || (left_[quote] != '\'' && left_[quote] != '"'))
      fail_attribute(tag);
    const std::size_t end = left_.find(left_[quote], quote + 1);
    if (end == std::string_view::npos) fail_attribute(tag);
    tag.attributes.try_emplace(std::string(name), without_references(left_.substr(quote + 1, end - quote - 1)));
    skip(end + 1);
  }

  [[noreturn]] void fail_attribute(const Tag& tag) const {
    if (left_.empty()) io::fail(path_, line_, fmt::format("the tag <{}> has no '>'", io::as_one_line(tag.name)));
    const std::string_view shown = left_.substr(0, std::min(left_.find_first_of("\r\n"), left_.size()));
    io::fail(
        path_, line_,
        fmt::format("{} in the tag <{}>; name='value' is expected", io::in_quotes(shown), io::as_one_line(tag.name)));
  }

  const std::string& path_;
  std::string_view left_;
  std::string_view text_;
  std::size_t line_ = 1;
  char line_end_ = '\n';
};

/// The landmarks of a box, and their names.
struct Box {
  std::vector<std::pair<double, double>> places;
  std::vector<std::string> names;
};

/// The order of the parts: by their numbers where all names are such, as imglab sorts them as text; else as they stand.
std::vector<std::size_t> order_of(const std::vector<std::string>& names) {
  std::vector<std::pair<std::size_t, std::size_t>> numbered;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const std::optional<std::size_t> number = parse_count(names[i])) numbered.emplace_back(*number, i);
    order.push_back(i);
  }
  if (numbered.size() < names.size()) return order;
  std::sort(numbered.begin(), numbered.end());
  std::transform(numbered.begin(), numbered.end(), order.begin(), [](const auto& entry) { return entry.second; });
  return order;
}

/// One pass over the tags of a file.
class DlibReader {
 public:
  DlibReader(const std::string& path, std::string_view text) : path_(path), tags_(path, text) {}

  LandmarkFile read() {
    while (const std::optional<Tag> tag = tags_.take()) {
      if (tag->begins) begin(*tag);
      if (tag->ends) end(*tag);
    }
    if (!open_.empty())
      io::fail(path_, open_.back().line,
               fmt::format("<{}> has no end in this file", io::as_one_line(open_.back().name)));
    if (file_.shapes.empty()) io::fail(path_, tags_.line(), "there is no <box> with landmarks in this file");
    if (empty_boxes_ > 0)
      file_.warnings.push_back(fmt::format("{}: {} without a <part> {} left out", path_,
                                           empty_boxes_ == 1 ? "1 box" : fmt::format("{} boxes", empty_boxes_),
                                           empty_boxes_ == 1 ? "is" : "are"));
    return std::move(file_);
  }

 private:
  void begin(const Tag& tag) {
    if (tag.name == "image") {
      const auto file = tag.attributes.find("file");
      image_ = file == tag.attributes.end() ? std::string() : file->second;
      first_of_image_ = file_.shapes.size();
    } else if (tag.name == "box") {
      if (box_) io::fail(path_, tag.line, "a <box> within another; </box> is expected before it");
      box_.emplace();
      properties_.clear();
      keep_frame(tag);
    } else if (tag.name == "part") {
      add_part(tag);
    }
    open_.push_back(tag);
  }

  void end(const Tag& tag) {
    if (open_.empty() || open_.back().name != tag.name)
      io::fail(path_, tag.line,
               fmt::format("</{}> where {} is expected", io::as_one_line(tag.name),
                           open_.empty() ? "nothing" : "</" + io::as_one_line(open_.back().name) + ">"));
    open_.pop_back();
    if (tag.name == "label" && box_ && !tags_.text().empty()) properties_.emplace_back("label", tags_.text());
    if (tag.name == "box") finish_box();
    if (tag.name == "image") name_boxes();
  }

  void keep_frame(const Tag& tag) {
    for (const char* key : {"left", "top", "width", "height"})
      if (const auto found = tag.attributes.find(key); found != tag.attributes.end())
        properties_.emplace_back(fmt::format("box.{}", key), found->second);
  }

  void add_part(const Tag& tag) {
    if (!box_) io::fail(path_, tag.line, "a <part> outside of all boxes; it must be between <box> and </box>");
    const auto name = tag.attributes.find("name");
    const std::string label = name == tag.attributes.end() ? std::string() : name->second;
    if (!label.empty() && !labels_.insert(label).second)
      io::fail(path_, tag.line, fmt::format("the part {} is in this box twice", io::in_quotes(label)));
    io::CoordinatePlace place{path_, tag.line,
                              label.empty() ? std::to_string(box_->names.size() + 1) : io::in_quotes(label),
                              fmt::format("box {}", file_.shapes.size() + empty_boxes_ + 1), 0};
    const double x = coordinate(tag, "x", place);
    place.axis = 1;
    box_->places.emplace_back(x, coordinate(tag, "y", place));
    box_->names.push_back(label);
  }

  double coordinate(const Tag& tag, const std::string& key, const io::CoordinatePlace& place) const {
    const auto found = tag.attributes.find(key);
    if (found == tag.attributes.end())
      io::fail(path_, tag.line, fmt::format("the part {} has no {}='...'", place.landmark, key));
    return io::parse_coordinate(io::trim(found->second), place);
  }

  void finish_box() {
    const Box box = std::move(*box_);
    box_.reset();
    labels_.clear();
    if (box.names.empty()) {
      ++empty_boxes_;
      return;
    }
    Landmarks& shape = file_.shapes.emplace_back();
    shape.points.resize(2, static_cast<Eigen::Index>(box.names.size()));
    Eigen::Index column = 0;
    for (const std::size_t i : order_of(box.names)) {
      shape.points.col(column++) = Eigen::Vector2d(box.places[i].first, box.places[i].second);
      shape.labels.push_back(box.names[i]);
    }
    shape.labels = io::unless_all_empty(std::move(shape.labels));
    shape.image = image_;
    shape.properties = std::exchange(properties_, {});
  }

  /// A box alone is called as its image is, several have their numbers behind it.
  void name_boxes() {
    const std::string stem = io::image_stem(image_);
    const bool is_alone = file_.shapes.size() == first_of_image_ + 1;
    for (std::size_t i = first_of_image_; i < file_.shapes.size() && !stem.empty(); ++i)
      file_.shapes[i].name = is_alone ? stem : fmt::format("{}_{}", stem, i - first_of_image_ + 1);
    image_.clear();
  }

  const std::string& path_;
  Tags tags_;
  LandmarkFile file_;
  std::vector<Tag> open_;
  std::string image_;
  std::size_t first_of_image_ = 0;
  std::optional<Box> box_;
  std::vector<std::pair<std::string, std::string>> properties_;  // of the box
  std::set<std::string> labels_;                                 // in the box
  std::size_t empty_boxes_ = 0;
};

/// XML with the elements dataset and image or images.
bool sniff_dlib(std::string_view text) {
  text = io::without_byte_order_mark(text);
  text.remove_prefix(std::min(text.find_first_not_of(kXmlBlanks), text.size()));
  return (text.starts_with("<?xml") || text.starts_with("<dataset")) && text.find("<dataset") != text.npos &&
         text.find("<image") != text.npos;
}

LandmarkFile read_dlib(const std::string& path, std::string_view text) {
  if (text.find('\0') != std::string_view::npos) io::split_lines(path, text);  // refuses it
  return DlibReader(path, text).read();
}

}  // namespace

LandmarkFormat dlib_format() {
  return {
      .name = "dlib",
      .extensions = {"xml"},
      .help =
          "landmarks of dlib and imglab: each <box> of an <image> is a shape, each <part> a landmark with its name as "
          "label",
      .sniff = sniff_dlib,
      .read = read_dlib,
      .y_down = true};
}

}  // namespace pulson::formats
