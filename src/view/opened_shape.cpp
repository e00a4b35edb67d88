#include "opened_shape.hpp"

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "formats/frame_text.hpp"
#include "formats/json/json_landmarks.hpp"

namespace pulson::view {
namespace {

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

// The nearest number of so many significant decimal digits.
double rounded(double number, int digits) {
  if (number == 0 || !std::isfinite(number)) return number;
  const int places = digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(number))));
  const double power = std::pow(10.0, std::abs(places));
  return places >= 0 ? std::round(number * power) / power : std::round(number / power) * power;
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
  return displayed_pixels(frame.to_pixels(coordinates), orientation, width(), height());
}

Points OpenedShape::from_page(const Points& pixels) const {
  const Points exact = frame.to_landmarks(stored_pixels(pixels, orientation, width(), height()));
  const bool swaps = page_turn(orientation).swaps;
  Points points = exact;
  // Each axis of the page is of one coordinate alone. From many digits to few: the last that fits is the shortest.
  for (int digits = std::numeric_limits<double>::digits10; digits > 0; --digits) {
    const Points candidates = exact.unaryExpr([&](double x) { return rounded(x, digits); });
    const Points pages = to_page(candidates);
    for (Eigen::Index a = 0; a < points.cols(); ++a)
      for (Eigen::Index axis = 0; axis < 2; ++axis)
        if (const Eigen::Index shown = swaps ? 1 - axis : axis; pages(shown, a) == pixels(shown, a))
          points(axis, a) = candidates(axis, a);
  }
  return points;
}

nlohmann::ordered_json json_of_opened(const OpenedShape& opened) {
  const Landmarks& shape = opened.shape;
  nlohmann::ordered_json json{{"shape", formats::shape_json(shape)}, {"placed", formats::frame_json(opened.frame)}};
  // shape_json leaves out a frame that says nothing; one that is there is read as it is.
  json["shape"]["frame"] = formats::frame_json(shape.frame);
  if (opened.orientation != 1) json["orientation"] = opened.orientation;
  if (!shape.units.empty()) json["units"] = shape.units;
  if (!shape.axes.empty()) json["axes"] = shape.axes;
  return json;
}

OpenedShape opened_of_json(const nlohmann::json& json, const std::string& file) {
  const formats::JsonValue value(json, file, "shapes");
  OpenedShape opened{formats::shape_of_json(value.at("shape")), formats::read_frame(value.at("placed"))};
  if (value.has("orientation")) opened.orientation = value.at("orientation").count();
  opened.shape.units = formats::text_of(value, "units");
  opened.shape.axes = formats::text_of(value, "axes");
  if (opened.frame.width < 1 || opened.frame.height < 1) value.at("placed").fail("has no width and height");
  if (opened.orientation < 1 || opened.orientation > 8) value.at("orientation").fail("is none of 1 to 8");
  return opened;
}

}  // namespace pulson::view
