// Annotations of CVAT in XML, versions "for images 1.1" and "for video 1.1": <image> with <points>, <polyline>,
// <polygon> and <skeleton>, or <track> with these for each frame. The points of an image or frame are the landmarks of
// a shape; each skeleton is a shape of its own. See https://docs.cvat.ai/docs/manual/advanced/xml_format/.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "text_lines.hpp"
#include "xml_tags.hpp"

namespace pulson::formats {
namespace {

/// `10.5,20;30,40`
Points parse_points(const std::string& path, const Tag& tag, const std::string& label) {
  std::vector<double> coordinates;
  std::string_view text = tag.attributes.contains("points") ? std::string_view(tag.attributes.at("points")) : "";
  while (!text.empty()) {
    std::string_view point = text.substr(0, text.find(';'));
    text.remove_prefix(std::min(point.size() + 1, text.size()));
    const std::size_t comma = point.find(',');
    if (comma == std::string_view::npos)
      text::fail(
          path, tag.line,
          fmt::format("{} in the points of {}; x,y is expected", text::in_quotes(point), text::in_quotes(label)));
    text::CoordinatePlace place{path, tag.line, text::in_quotes(label), "", 0};
    coordinates.push_back(text::parse_coordinate(text::trim(point.substr(0, comma)), place));
    place.axis = 1;
    coordinates.push_back(text::parse_coordinate(text::trim(point.substr(comma + 1)), place));
  }
  return text::points_from(coordinates, 2);
}

/// A picture, and what was placed on it.
struct CvatPicture {
  Landmarks shape{};  ///< without skeletons
  GatheredPoints points{};
  std::vector<Landmarks> skeletons{};
};

class CvatReader {
 public:
  CvatReader(const std::string& path, std::string_view text) : path_(path), tags_(path, text) {}

  LandmarkFile read() {
    while (const std::optional<Tag> tag = tags_.take()) {
      if (tag->begins) begin(*tag);
      if (tag->ends) end(*tag);
    }
    for (auto& [key, picture] : pictures_) finish(picture);
    if (file_.shapes.empty())
      text::fail(path_, tags_.line(), "there are no <points>, <skeleton>, <polyline> or <polygon> in this file");
    take_lines_where_alone(path_, file_);
    drop_repeated_labels(path_, file_);
    name_by_images(file_.shapes);
    for (const auto& [kind, count] : unused_)
      file_.warnings.push_back(fmt::format("{}: {} <{}> not used", path_, count, kind));
    return std::move(file_);
  }

 private:
  void begin(const Tag& tag) {
    if (tag.name == "image") {
      picture_ = number_of(tag, "id", pictures_.size());
      Landmarks& shape = pictures_[picture_].shape;
      shape.image = tag.attribute("name");
      shape.frame.width = static_cast<int>(parse_count(tag.attribute("width")).value_or(0));
      shape.frame.height = static_cast<int>(parse_count(tag.attribute("height")).value_or(0));
    } else if (tag.name == "track") {
      track_ = tag.attribute("label");
    } else if (tag.name == "skeleton") {
      skeleton_.emplace();
      find_frame(tag);
    } else if (tag.name == "points" || tag.name == "polyline" || tag.name == "polygon") {
      find_frame(tag);
      add(tag);
    } else if (tag.name == "box" || tag.name == "cuboid" || tag.name == "ellipse" || tag.name == "mask") {
      ++unused_[tag.name];
    }
  }

  void end(const Tag& tag) {
    if (tag.name == "track") track_.reset();
    if (tag.name != "skeleton" || !skeleton_) return;
    Landmarks shape;
    skeleton_->move_to(shape);
    skeleton_.reset();
    if (shape.count() > 0) pictures_[picture_].skeletons.push_back(std::move(shape));
  }

  std::size_t number_of(const Tag& tag, const std::string& key, std::size_t otherwise) const {
    const std::string text = tag.attribute(key);
    if (text.empty()) return otherwise;
    const std::optional<std::size_t> number = parse_count(text);
    if (!number)
      text::fail(path_, tag.line,
                 fmt::format("{} of <{}> is {}; a whole number is needed", key, text::as_one_line(tag.name),
                             text::in_quotes(text)));
    return *number;
  }

  /// Of what stands in a track.
  void find_frame(const Tag& tag) {
    if (!track_ || !tag.attributes.contains("frame")) return;
    picture_ = number_of(tag, "frame", 0);
    pictures_[picture_].shape.name = std::to_string(picture_);
  }

  void add(const Tag& tag) {
    const std::string label = tag.attributes.contains("label") ? tag.attribute("label") : track_.value_or("");
    const Points points = parse_points(path_, tag, label);
    CvatPicture& picture = pictures_[picture_];
    if (tag.name == "polyline") return picture.shape.curves.push_back(points);
    if (tag.name == "polygon") return picture.shape.outlines.push_back(points);
    GatheredPoints& gathered = skeleton_ ? *skeleton_ : picture.points;
    const bool is_outside = tag.attribute("outside") == "1";
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const std::string name = points.cols() == 1 ? label : fmt::format("{}_{}", label, i + 1);
      if (is_outside)
        gathered.add_missing(name);
      else
        gathered.add(points.col(i), name);
    }
  }

  void finish(CvatPicture& picture) {
    Landmarks& shape = picture.shape;
    picture.points.move_to(shape);
    for (Landmarks& skeleton : picture.skeletons) {
      skeleton.image = shape.image;
      skeleton.frame = shape.frame;
      skeleton.name = shape.name;
    }
    if (shape.count() > 0 || !shape.curves.empty() || !shape.outlines.empty()) file_.shapes.push_back(std::move(shape));
    for (Landmarks& skeleton : picture.skeletons) file_.shapes.push_back(std::move(skeleton));
  }

  const std::string& path_;
  Tags tags_;
  LandmarkFile file_;
  std::map<std::size_t, CvatPicture> pictures_;  // by the number of the image or frame
  std::size_t picture_ = 0;
  std::optional<std::string> track_;  // its label
  std::optional<GatheredPoints> skeleton_;
  std::map<std::string, std::size_t> unused_;
};

bool sniff_cvat(std::string_view text) {
  return is_xml_of(text, "annotations") &&
         (text.find("<image") != text.npos || text.find("<track") != text.npos || text.find("<meta") != text.npos);
}

LandmarkFile read_cvat(const std::string& path, std::string_view text) { return CvatReader(path, text).read(); }

}  // namespace

LandmarkFormat cvat_format() {
  return {.name = "cvat",
          .extensions = {},
          .help =
              "annotations of CVAT, of images or video: the points of an image as one shape with labels, each "
              "skeleton as one, outside is missing, polylines as curves, polygons as outlines",
          .sniff = sniff_cvat,
          .read = read_cvat,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

}  // namespace pulson::formats
