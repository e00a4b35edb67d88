// Landmarks of dlib in XML, as imglab writes them: images with boxes, and in each box parts with a name and a place in
// pixels, y downwards. Each box is a shape.

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "text_lines.hpp"
#include "xml_tags.hpp"

namespace pulson::formats {
namespace {

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
    if (file_.shapes.empty()) text::fail(path_, tags_.line(), "there is no <box> with landmarks in this file");
    if (empty_boxes_ > 0)
      file_.warnings.push_back(fmt::format("{}: {} without a <part> {} left out", path_,
                                           empty_boxes_ == 1 ? "1 box" : fmt::format("{} boxes", empty_boxes_),
                                           empty_boxes_ == 1 ? "is" : "are"));
    return std::move(file_);
  }

 private:
  void begin(const Tag& tag) {
    if (tag.name == "image") {
      image_ = tag.attribute("file");
      frame_.width = static_cast<int>(parse_count(tag.attribute("width")).value_or(0));
      frame_.height = static_cast<int>(parse_count(tag.attribute("height")).value_or(0));
      first_of_image_ = file_.shapes.size();
    } else if (tag.name == "box") {
      if (box_) text::fail(path_, tag.line, "a <box> within another; </box> is expected before it");
      box_.emplace();
      properties_.clear();
      keep_frame(tag);
    } else if (tag.name == "part") {
      add_part(tag);
    }
  }

  void end(const Tag& tag) {
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
    if (!box_) text::fail(path_, tag.line, "a <part> outside of all boxes; it must be between <box> and </box>");
    const std::string label = tag.attribute("name");
    if (!label.empty() && !labels_.insert(label).second)
      text::fail(path_, tag.line, fmt::format("the part {} is in this box twice", text::in_quotes(label)));
    text::CoordinatePlace place{path_, tag.line,
                                label.empty() ? std::to_string(box_->names.size() + 1) : text::in_quotes(label),
                                fmt::format("box {}", file_.shapes.size() + empty_boxes_ + 1), 0};
    const double x = coordinate_of(tag, place);
    place.axis = 1;
    box_->places.emplace_back(x, coordinate_of(tag, place));
    box_->names.push_back(label);
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
    shape.labels = text::unless_all_empty(std::move(shape.labels));
    shape.image = image_;
    shape.frame = frame_;
    shape.properties = std::exchange(properties_, {});
  }

  /// A box alone is called as its image is, several have their numbers behind it.
  void name_boxes() {
    const std::string stem = text::image_stem(image_);
    const bool is_alone = file_.shapes.size() == first_of_image_ + 1;
    for (std::size_t i = first_of_image_; i < file_.shapes.size() && !stem.empty(); ++i)
      file_.shapes[i].name = is_alone ? stem : fmt::format("{}_{}", stem, i - first_of_image_ + 1);
    image_.clear();
  }

  const std::string& path_;
  Tags tags_;
  LandmarkFile file_;
  std::string image_;
  Frame frame_;
  std::size_t first_of_image_ = 0;
  std::optional<Box> box_;
  std::vector<std::pair<std::string, std::string>> properties_;  // of the box
  std::set<std::string> labels_;                                 // in the box
  std::size_t empty_boxes_ = 0;
};

/// XML with the elements dataset and image or images.
bool sniff_dlib(std::string_view text) { return is_xml_of(text, "dataset") && text.find("<image") != text.npos; }

LandmarkFile read_dlib(const std::string& path, std::string_view text) { return DlibReader(path, text).read(); }

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
