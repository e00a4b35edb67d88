#include "core/coordinate_frame.hpp"

#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

std::optional<double> metres(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 5> kUnits = {
      {{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}}};
  for (const auto& [name, size] : kUnits)
    if (name == unit) return size;
  return std::nullopt;
}

bool differ(const std::string& a, const std::string& b) { return !a.empty() && !b.empty() && a != b; }

template <class Change>
void change_points(Landmarks& shape, const Change& change) {
  change(shape.points);
  for (Points& curve : shape.curves) change(curve);
  for (Points& outline : shape.outlines) change(outline);
}

}  // namespace

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
  if (!frame.axes.empty()) result.axes = frame.axes;
  if (!frame.units.empty()) result.units = frame.units;
  return result;
}

}  // namespace pulson
