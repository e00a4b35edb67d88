#include <string>

#include "formats/carriers/carried_file.hpp"
#include "fuzz_targets.hpp"
#include "fuzzing.hpp"

namespace pulson::fuzz {

bool carried_files(std::string_view input) {
  const std::size_t end = input.find('\n');
  const std::string kind(input.substr(0, end));
  const bool is_mesh = kind == "ply" || kind == "stl" || kind == "obj" || kind == "vtk" || kind == "vtp";
  if (end == std::string_view::npos || (!is_mesh && kind != "csv" && kind != "fcsv")) return false;
  const auto carried = [&](std::string text) {
    return attempt([&] { return formats::carry("f." + kind, std::move(text), {}, is_mesh ? 3 : 2); });
  };
  const auto file = carried(std::string(input.substr(end + 1)));
  if (!file || *file == nullptr) return true;
  const Points& points = (*file)->shape.points;
  require(static_cast<std::size_t>(points.cols()) <= input.size(), "a file has more points than bytes");
  const auto text = attempt([&] { return (*file)->with(points, (*file)->normals); });
  constexpr double kLargest = 1e30;  // floats hold it
  if (!text || !is_mesh || !(points.array().abs() < kLargest).all()) return true;
  // Written once, its numbers are in their fewest digits: they stay.
  const auto again = carried(*text);
  require(again && *again != nullptr && (*again)->shape.points.cols() == points.cols(),
          "a mesh that is written has other points");
  const auto third = carried((*again)->with((*again)->shape.points, (*again)->normals));
  require(third && *third != nullptr && (*third)->shape.points == (*again)->shape.points,
          "the points of a mesh change when they are written again");
  return true;
}

}  // namespace pulson::fuzz
