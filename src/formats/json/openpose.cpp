// Keypoints of OpenPose in JSON, a file for each frame: `people`, each with lists such as pose_keypoints_2d of
// [x1, y1, c1, x2, ...], where c is the confidence and 0 marks a missing one.
// See https://github.com/CMU-Perceptual-Computing-Lab/openpose/blob/master/doc/02_output.md.

#include <array>
#include <string>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "json_reader.hpp"

namespace pulson::formats {
namespace {

struct PosePart {
  const char* key;    ///< without `_2d` or `_3d`
  const char* group;  ///< where a person has several parts
};

constexpr std::array<PosePart, 4> kParts = {{{"pose_keypoints", "pose"},
                                             {"face_keypoints", "face"},
                                             {"hand_left_keypoints", "left hand"},
                                             {"hand_right_keypoints", "right hand"}}};

bool has_numbers(const JsonValue& person, const std::string& key) {
  return person.has(key) && !person.at(key).items().empty();
}

void add_part(const JsonValue& numbers, const std::string& group, GatheredPoints& points) {
  const Eigen::Index width = points.dimension() + 1;
  const Eigen::VectorXd all = numbers.numbers();
  if (all.size() % width != 0)
    numbers.fail(
        fmt::format("has {} numbers; {} of each keypoint, its place and confidence, are needed", all.size(), width));
  for (Eigen::Index i = 0; i < all.size(); i += width) {
    if (all[i + width - 1] == 0)
      points.add_missing("", group);
    else
      points.add(all.segment(i, width - 1), "", group);
  }
}

Landmarks read_person(const JsonValue& person) {
  if (!person.value().is_object()) person.fail("is not an object");
  bool is_in_plane = false;
  int parts = 0;
  for (const PosePart& part : kParts) {
    const bool is_2d = has_numbers(person, fmt::format("{}_2d", part.key));
    is_in_plane |= is_2d;
    parts += is_2d || has_numbers(person, fmt::format("{}_3d", part.key)) ? 1 : 0;
  }
  GatheredPoints points(is_in_plane || parts == 0 ? 2 : 3);
  for (const PosePart& part : kParts) {
    const std::string key = fmt::format("{}_{}d", part.key, points.dimension());
    if (has_numbers(person, key)) add_part(person.at(key), parts > 1 ? part.group : "", points);
  }
  Landmarks shape;
  points.move_to(shape);
  return shape;
}

bool sniff_openpose(std::string_view text) {
  const JsonKeys keys(text);
  if (!keys.is_object() || !keys.has(1, "people")) return false;
  for (const PosePart& part : kParts)
    if (keys.has(3, fmt::format("{}_2d", part.key)) || keys.has(3, fmt::format("{}_3d", part.key))) return true;
  return false;
}

LandmarkFile read_openpose(const std::string& path, std::string_view text) {
  const nlohmann::json value = parse_json(path, text);
  const JsonValue json(value, path);
  LandmarkFile file;
  for (const JsonValue& person : json.at("people").items()) file.shapes.push_back(read_person(person));
  if (file.shapes.empty()) json.at("people").fail("is empty: nobody was found in this frame");
  return file;
}

}  // namespace

LandmarkFormat openpose_format() {
  return {.name = "openpose",
          .extensions = {},
          .help =
              "keypoints of OpenPose: each of people is a shape, its pose, face and hands are groups, confidence 0 is "
              "missing",
          .sniff = sniff_openpose,
          .read = read_openpose,
          .y_down = true,
          .orientation = Orientation::kDisplayed};
}

}  // namespace pulson::formats
