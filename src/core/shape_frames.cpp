#include "core/shape_frames.hpp"

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson {

std::optional<double> metres(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 5> kUnits = {
      {{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}}};
  for (const auto& [name, size] : kUnits)
    if (name == unit) return size;
  return std::nullopt;
}

namespace {

bool differ(const std::string& a, const std::string& b) { return !a.empty() && !b.empty() && a != b; }

// "y of a.tps points up"
std::string direction_of_y(const Landmarks& shape) {
  return fmt::format("y of {} {}{}", shape.source, shape.frame.y_down ? "counts the rows of a picture" : "points up",
                     shape.frame.says_y ? "" : " (assumed: the file does not say)");
}

void turn_y(const Landmarks& frame, Landmarks& shape, std::vector<std::string>& notes) {
  if (frame.dimension() != 2 || shape.dimension() != 2 || frame.frame.y_down == shape.frame.y_down) return;
  if (shape.frame.height == 0)
    throw InputError(
        fmt::format("{}, {}, and the height of the picture of {} is not known: `y_down` says it for all files, and "
                    "`mirror_y` converts one",
                    direction_of_y(frame), direction_of_y(shape), shape.source));
  notes.push_back(fmt::format("{}, {}; converted by the height of its picture, {} pixels", direction_of_y(shape),
                              direction_of_y(frame), shape.frame.height));
  mirror_y(shape);
}

}  // namespace

void mirror_y(Landmarks& shape) {
  const Frame before = shape.frame;
  shape.frame.y_down = !before.y_down;
  change_points(shape, [&](Points& points) {
    if (points.rows() == 2) points = shape.frame.to_landmarks(before.to_pixels(points));
  });
}

Landmarks in_frame_of(const Landmarks& frame, const Landmarks& shape, std::vector<std::string>& notes) {
  Landmarks result = shape;
  if (differ(frame.axes, shape.axes) && shape.dimension() >= 2) {
    change_points(result, [](Points& points) { points.topRows(2) *= -1; });
    notes.push_back(fmt::format("{}: its axes are {}, those of {} {}; converted by changing the signs of x and y",
                                shape.source, shape.axes, frame.source, frame.axes));
  }
  if (differ(frame.units, shape.units)) {
    const auto from = metres(shape.units), to = metres(frame.units);
    if (!from || !to)
      throw InputError(fmt::format("{}: its coordinates are in {}, those of {} in {}; both need the same unit",
                                   shape.source, shape.units, frame.source, frame.units));
    change_points(result, [&](Points& points) { points *= *from / *to; });
    notes.push_back(fmt::format("{}: its unit of length is {}, that of {} {}; converted", shape.source, shape.units,
                                frame.source, frame.units));
  }
  turn_y(frame, result, notes);
  if (!frame.axes.empty()) result.axes = frame.axes;
  if (!frame.units.empty()) result.units = frame.units;
  return result;
}

}  // namespace pulson
