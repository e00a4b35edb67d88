// Keypoints of COCO in JSON: `images`, `categories` with the names of keypoints and a `skeleton`, and `annotations`,
// each with the keypoints [x1, y1, v1, x2, ...] of one shape, where v = 0 marks a missing one. Also its lists of
// results,
// [{"image_id": 1, "keypoints": [...], "score": 0.9}, ...].
// See https://cocodataset.org/#format-data.

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "json_reader.hpp"

namespace pulson::formats {
namespace {

struct CocoCategory {
  std::vector<std::string> labels;
  std::vector<std::pair<int, int>> links;
};

struct CocoImage {
  std::string file;
  int width = 0;
  int height = 0;
};

class CocoReader {
 public:
  CocoReader(const std::string& path, const JsonValue& json) : path_(path), json_(json) {}

  LandmarkFile read() {
    if (json_.has("images"))
      for (const JsonValue& image : json_.at("images").items()) read_image(image);
    if (json_.has("categories"))
      for (const JsonValue& category : json_.at("categories").items()) read_category(category);
    const JsonValue annotations = json_.value().is_array() ? json_ : json_.at("annotations");
    for (const JsonValue& annotation : annotations.items()) read_annotation(annotation);
    if (file_.shapes.empty()) annotations.fail("has no annotation with keypoints");
    name_by_images(file_.shapes);
    if (without_keypoints_ > 0)
      file_.warnings.push_back(
          fmt::format("{}: {} without keypoints left out", path_, text::counted(without_keypoints_, "annotation")));
    if (hidden_ > 0)
      file_.warnings.push_back(
          fmt::format("{}: {} with a position and visibility 0, not labelled by COCO's rule, read "
                      "as missing",
                      path_, text::counted(hidden_, "keypoint")));
    return std::move(file_);
  }

 private:
  void read_image(const JsonValue& image) {
    CocoImage& read = images_[text_of(image, "id")];
    if (image.has("file_name")) read.file = image.at("file_name").text();
    if (image.has("width")) read.width = image.at("width").count();
    if (image.has("height")) read.height = image.at("height").count();
  }

  void read_category(const JsonValue& category) {
    CocoCategory& read = categories_[text_of(category, "id")];
    if (category.has("keypoints")) read.labels = category.at("keypoints").texts();
    if (category.has("skeleton")) read.links = category.at("skeleton").links(static_cast<int>(read.labels.size()), 1);
  }

  void read_annotation(const JsonValue& annotation) {
    if (!annotation.has("keypoints") || annotation.at("keypoints").items().empty()) {
      ++without_keypoints_;
      return;
    }
    Landmarks& shape = file_.shapes.emplace_back();
    read_keypoints(annotation.at("keypoints"), shape);
    if (const auto category = categories_.find(text_of(annotation, "category_id")); category != categories_.end()) {
      const std::vector<std::string>& labels = category->second.labels;
      if (!labels.empty() && labels.size() != static_cast<std::size_t>(shape.count()))
        annotation.at("keypoints")
            .fail(fmt::format("has {}; its category names {}",
                              text::counted(static_cast<std::size_t>(shape.count()), "keypoint"), labels.size()));
      shape.labels = labels;
      shape.links = category->second.links;
    }
    const std::string id = text_of(annotation, "image_id");
    if (const auto image = images_.find(id); image != images_.end()) {
      shape.image = image->second.file;
      shape.frame.width = image->second.width;
      shape.frame.height = image->second.height;
    } else if (!id.empty()) {
      shape.name = id;
    }
  }

  void read_keypoints(const JsonValue& keypoints, Landmarks& shape) {
    const Eigen::VectorXd numbers = keypoints.numbers();
    if (numbers.size() % 3 != 0)
      keypoints.fail(
          fmt::format("has {} numbers; three of each keypoint, x, y and visibility, are needed", numbers.size()));
    const Eigen::Map<const Points> triples(numbers.data(), 3, numbers.size() / 3);
    shape.points = triples.topRows(2);
    // results leave the visibility at 0 for all, as it is not evaluated
    const bool has_flags = json_.value().is_object() || (triples.row(2).array() != 0).any();
    for (Eigen::Index i = 0; i < triples.cols(); ++i) {
      const bool is_at_zero = triples(0, i) == 0 && triples(1, i) == 0;
      if (triples(2, i) != 0 || (!has_flags && !is_at_zero)) continue;
      hidden_ += is_at_zero ? 0 : 1;
      shape.points.col(i).setConstant(text::kMissing);
    }
  }

  const std::string& path_;
  const JsonValue& json_;
  LandmarkFile file_;
  std::map<std::string, CocoImage> images_;
  std::map<std::string, CocoCategory> categories_;
  std::size_t without_keypoints_ = 0;
  std::size_t hidden_ = 0;
};

/// An object with `annotations` that have `keypoints`, or a list of objects with these and `image_id`.
bool sniff_coco(std::string_view text) {
  const JsonKeys keys(text);
  return (keys.has(1, "annotations") && (keys.has(1, "categories") || keys.has(1, "images"))) ||
         (keys.is_list() && keys.has(2, "image_id") && keys.has(2, "keypoints"));
}

LandmarkFile read_coco(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  return CocoReader(path, json).read();
}

}  // namespace

LandmarkFormat coco_format() {
  return {.name = "coco",
          .extensions = {},
          .help =
              "keypoints of COCO: each annotation is a shape, named by its image; names of keypoints are labels, the "
              "skeleton links them, visibility 0 is missing",
          .sniff = sniff_coco,
          .read = read_coco,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

}  // namespace pulson::formats
