#include "opened_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "pulson/images/image_warp.hpp"
#include "warp/placed_picture.hpp"

namespace pulson {
namespace {

constexpr double kEmptySide = 1000;   // pixels of the longer side of an empty picture
constexpr double kEmptyMargin = 0.1;  // of it on each side

// Of orientation 1 to 8, as EXIF numbers them: which of the stored axes are reversed, and whether rows are columns.
struct PageTurn {
  bool swaps, reverses_x, reverses_y;  // of the displayed axes
};

PageTurn page_turn(int orientation) {
  switch (orientation) {
    case 2:
      return {false, true, false};
    case 3:
      return {false, true, true};
    case 4:
      return {false, false, true};
    case 5:
      return {true, false, false};
    case 6:
      return {true, true, false};
    case 7:
      return {true, true, true};
    case 8:
      return {true, false, true};
    default:
      return {false, false, false};
  }
}

void reverse_axes(Points& points, const PageTurn& turn, int width, int height) {
  if (turn.reverses_x) points.row(0) = (width - 1 - points.row(0).array()).matrix().eval();
  if (turn.reverses_y) points.row(1) = (height - 1 - points.row(1).array()).matrix().eval();
}

view::PlacedLandmark as_placed_landmark(const Points& pixels, Eigen::Index a) {
  if (!pixels.col(a).allFinite()) return {};
  return {view::Placement::kPlaced, pixels.col(a)};
}

// The place of each of the shape's landmarks among those of the document, which grow.
std::vector<std::size_t> places_of(const Landmarks& shape, std::vector<view::ViewLandmark>& landmarks, bool by_name) {
  std::vector<std::size_t> places;
  for (int a = 0; a < shape.count(); ++a) {
    const auto k = static_cast<std::size_t>(a);
    const std::string name = shape.labels.empty() ? "" : shape.labels[k];
    std::size_t place = k;
    if (by_name)
      place = static_cast<std::size_t>(
          std::find_if(landmarks.begin(), landmarks.end(), [&](const auto& l) { return l.name == name; }) -
          landmarks.begin());
    if (place >= landmarks.size()) {
      place = landmarks.size();
      landmarks.push_back({name, shape.groups.empty() ? "" : shape.groups[k]});
    }
    places.push_back(place);
  }
  return places;
}

}  // namespace

Points displayed_pixels(const Points& stored, int orientation, int width, int height) {
  const PageTurn turn = page_turn(orientation);
  Points points = stored;
  if (turn.swaps) points.row(0).swap(points.row(1));
  reverse_axes(points, turn, width, height);
  return points;
}

Points stored_pixels(const Points& displayed, int orientation, int width, int height) {
  const PageTurn turn = page_turn(orientation);
  Points points = displayed;
  reverse_axes(points, turn, width, height);
  if (turn.swaps) points.row(0).swap(points.row(1));
  return points;
}

Points OpenedShape::to_page(const Points& coordinates) const {
  return displayed_pixels(frame.to_pixels(coordinates), orientation, width, height);
}

Points OpenedShape::from_page(const Points& pixels) const {
  return frame.to_landmarks(stored_pixels(pixels, orientation, width, height));
}

OpenedShape shape_on_picture(Landmarks shape, const std::string& picture, Picture pixels,
                             std::vector<std::string>& notes) {
  const PlacedPicture placed = place_picture(std::move(pixels), picture, shape, {});
  for (const auto* texts : {&placed.notes, &placed.warnings}) notes.insert(notes.end(), texts->begin(), texts->end());
  OpenedShape opened{std::move(shape), placed.frame, placed.picture.orientation()};
  opened.width = placed.frame.width;
  opened.height = placed.frame.height;
  if (opened.orientation > 4) std::swap(opened.width, opened.height);
  opened.picture = picture;
  return opened;
}

OpenedShape shape_without_picture(Landmarks shape) {
  OpenedShape opened{std::move(shape), Frame{}};
  Frame& frame = opened.frame;
  frame.y_down = opened.shape.frame.y_down;
  const std::vector<int> missing = incomplete_points(opened.shape.points);
  opened.width = opened.height = static_cast<int>(kEmptySide);
  frame.height = opened.height;
  if (std::ssize(missing) == opened.shape.count()) return opened;
  const auto [low, high] = bounding_box(opened.shape.points);
  const Eigen::VectorXd extent = high - low;
  const double side = extent.maxCoeff() > 0 ? extent.maxCoeff() : 1, unit = side * (1 + 2 * kEmptyMargin) / kEmptySide;
  opened.width = static_cast<int>(std::ceil((extent[0] + 2 * kEmptyMargin * side) / unit));
  opened.height = static_cast<int>(std::ceil((extent[1] + 2 * kEmptyMargin * side) / unit));
  frame.width = opened.width;
  frame.height = opened.height;
  frame.unit_per_pixel = {unit, unit};
  frame.origin = {low[0] - kEmptyMargin * side, low[1] - kEmptyMargin * side};
  return opened;
}

void add_shapes(const std::vector<OpenedShape>& shapes, view::ViewDocument& document) {
  const bool by_name = std::all_of(shapes.begin(), shapes.end(), [](const auto& s) { return !s.shape.labels.empty(); });
  std::vector<std::vector<std::size_t>> places;
  places.reserve(shapes.size());
  for (const OpenedShape& opened : shapes) places.push_back(places_of(opened.shape, document.landmarks, by_name));
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const OpenedShape& opened = shapes[i];
    view::ViewSpecimen specimen{opened.shape.name, opened.picture, opened.width, opened.height};
    specimen.shape = opened.shape.source;
    specimen.landmarks.resize(document.landmarks.size());
    const Points pixels = opened.to_page(opened.shape.points);
    for (std::size_t a = 0; a < places[i].size(); ++a)
      specimen.landmarks[places[i][a]] = as_placed_landmark(pixels, static_cast<Eigen::Index>(a));
    for (const int a : opened.shape.absent)
      specimen.landmarks[places[i][static_cast<std::size_t>(a)]] = {view::Placement::kAbsent};
    for (const auto& [a, b] : opened.shape.links) {
      const std::pair link(static_cast<int>(places[i][static_cast<std::size_t>(a)]),
                           static_cast<int>(places[i][static_cast<std::size_t>(b)]));
      if (std::find(document.links.begin(), document.links.end(), link) == document.links.end())
        document.links.push_back(link);
    }
    document.specimens.push_back(std::move(specimen));
  }
}

}  // namespace pulson
