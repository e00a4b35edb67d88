#include "opened_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "warp/placed_picture.hpp"

namespace pulson {
namespace {

constexpr double kEmptySide = 1000;   // pixels of the longer side of an empty picture
constexpr double kEmptyMargin = 0.1;  // of it on each side

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

// Without what the document holds itself.
view::OpenedShape kept_part(view::OpenedShape opened) {
  Landmarks& shape = opened.shape;
  shape.points.resize(2, 0);
  shape.labels.clear();
  shape.groups.clear();
  shape.links.clear();
  shape.numbers.clear();
  shape.absent.clear();
  return opened;
}

}  // namespace

PlacedShape shape_on_picture(Landmarks shape, const std::string& picture, Picture pixels,
                             std::vector<std::string>& notes) {
  const PlacedPicture placed = place_picture(std::move(pixels), picture, shape, {});
  for (const auto* texts : {&placed.notes, &placed.warnings}) notes.insert(notes.end(), texts->begin(), texts->end());
  if (shape.image.empty()) shape.image = std::filesystem::path(picture).filename().string();
  shape.frame = placed.frame;
  return {{std::move(shape), placed.frame, placed.picture.orientation()}, picture};
}

PlacedShape shape_without_picture(Landmarks shape) {
  Frame frame;
  frame.y_down = shape.frame.y_down;
  frame.width = frame.height = static_cast<int>(kEmptySide);
  if (std::ssize(incomplete_points(shape.points)) < shape.count()) {
    const auto [low, high] = bounding_box(shape.points);
    const Eigen::VectorXd extent = high - low;
    const double side = extent.maxCoeff() > 0 ? extent.maxCoeff() : 1,
                 unit = side * (1 + 2 * kEmptyMargin) / kEmptySide;
    frame.width = static_cast<int>(std::ceil((extent[0] + 2 * kEmptyMargin * side) / unit));
    frame.height = static_cast<int>(std::ceil((extent[1] + 2 * kEmptyMargin * side) / unit));
    frame.unit_per_pixel = {unit, unit};
    frame.origin = {low[0] - kEmptyMargin * side, low[1] - kEmptyMargin * side};
  }
  return {{std::move(shape), frame}};
}

void add_shapes(const std::vector<PlacedShape>& shapes, view::ViewDocument& document) {
  const bool by_name =
      std::all_of(shapes.begin(), shapes.end(), [](const auto& s) { return !s.opened.shape.labels.empty(); }) &&
      std::all_of(document.landmarks.begin(), document.landmarks.end(), [](const auto& l) { return !l.name.empty(); });
  std::vector<std::vector<std::size_t>> places;
  places.reserve(shapes.size());
  for (const PlacedShape& placed : shapes)
    places.push_back(places_of(placed.opened.shape, document.landmarks, by_name));
  for (view::ViewSpecimen& known : document.specimens) {
    known.landmarks.resize(document.landmarks.size());
    if (!known.second_pass.empty()) known.second_pass.resize(document.landmarks.size());
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto& [opened, picture] = shapes[i];
    const Landmarks& shape = opened.shape;
    view::ViewSpecimen specimen{shape.name, picture, opened.width(), opened.height()};
    specimen.shape = shape.source;
    specimen.landmarks.resize(document.landmarks.size());
    const Points pixels = opened.to_page(shape.points);
    for (std::size_t a = 0; a < places[i].size(); ++a)
      specimen.landmarks[places[i][a]] = as_placed_landmark(pixels, static_cast<Eigen::Index>(a));
    for (const int a : shape.absent)
      specimen.landmarks[places[i][static_cast<std::size_t>(a)]] = {view::Placement::kAbsent};
    for (const auto& [a, b] : shape.links) {
      const std::pair link(static_cast<int>(places[i][static_cast<std::size_t>(a)]),
                           static_cast<int>(places[i][static_cast<std::size_t>(b)]));
      if (std::find(document.links.begin(), document.links.end(), link) == document.links.end())
        document.links.push_back(link);
    }
    document.specimens.push_back(std::move(specimen));
    document.shapes[shape.source] = kept_part(opened);
  }
}

}  // namespace pulson
