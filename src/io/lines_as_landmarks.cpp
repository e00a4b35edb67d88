#include "lines_as_landmarks.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "text.hpp"

namespace pulson::io {

bool take_lines_as_landmarks(Landmarks& shape) {
  if (shape.count() > 0 || (shape.curves.empty() && shape.outlines.empty())) return false;
  const Eigen::Index dimension = (shape.curves.empty() ? shape.outlines : shape.curves).front().rows();
  std::vector<double> coordinates;
  const auto take = [&](std::vector<Points>& lines, const std::string& kind) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      coordinates.insert(coordinates.end(), lines[i].reshaped().begin(), lines[i].reshaped().end());
      shape.groups.insert(shape.groups.end(), static_cast<std::size_t>(lines[i].cols()),
                          fmt::format("{} {}", kind, i + 1));
    }
    lines.clear();
  };
  take(shape.curves, "curve");
  take(shape.outlines, "outline");
  shape.points = Points::Map(coordinates.data(), dimension, static_cast<Eigen::Index>(shape.groups.size()));
  return true;
}

bool give_lines_back(Landmarks& shape) {
  const auto is_line = [](const std::string& group) {
    return group.starts_with("curve ") || group.starts_with("outline ");
  };
  if (shape.groups.empty() || !std::all_of(shape.groups.begin(), shape.groups.end(), is_line)) return false;
  for (const std::vector<int>& line : landmarks_by_group(shape)) {
    const bool is_curve = shape.groups[static_cast<std::size_t>(line.front())].starts_with("curve ");
    (is_curve ? shape.curves : shape.outlines).emplace_back(shape.points(Eigen::all, line));
  }
  shape.points.resize(shape.points.rows(), 0);
  shape.groups.clear();
  shape.labels.clear();
  shape.numbers.clear();
  return true;
}

std::string taken_as_landmarks(std::size_t shapes) {
  return counted(shapes, "shape") +
         " without landmarks: the points of curves and outlines are taken as landmarks, one group for each";
}

}  // namespace pulson::io
