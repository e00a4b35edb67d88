#include "shape_lines.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

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

namespace {

/// The complete points, with the first one again at the end of a closed line.
Points vertices_of(const Points& line, LineEnds ends) {
  std::vector<int> known;
  for (Eigen::Index i = 0; i < line.cols(); ++i)
    if (!line.col(i).hasNaN()) known.push_back(static_cast<int>(i));
  if (ends == LineEnds::kClosed && !known.empty()) known.push_back(known.front());
  return line(Eigen::all, known);
}

/// The arc length from the first point to each.
Eigen::VectorXd lengths_along(const Points& vertices) {
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(vertices.cols());
  for (Eigen::Index i = 1; i < vertices.cols(); ++i)
    lengths[i] = lengths[i - 1] + (vertices.col(i) - vertices.col(i - 1)).stableNorm();
  return lengths;
}

}  // namespace

Points evenly_spaced(const Points& line, LineEnds ends, int count) {
  const Points vertices = vertices_of(line, ends);
  if (vertices.cols() == 0) return Points::Constant(line.rows(), count, std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXd lengths = lengths_along(vertices);
  const double total = lengths[lengths.size() - 1];
  if (!(total > 0)) throw InputError("it has no length");
  if (!std::isfinite(total)) throw InputError("its length is too large");
  const int steps = ends == LineEnds::kClosed ? count : count - 1;
  Points points(line.rows(), count);
  Eigen::Index next = 1;  // the vertex at or beyond the point
  for (int i = 0; i < count; ++i) {
    const double length = i == steps ? total : total * i / steps;
    while (next + 1 < vertices.cols() && lengths[next] < length) ++next;
    const double piece = lengths[next] - lengths[next - 1];
    const double part = piece > 0 ? std::clamp((length - lengths[next - 1]) / piece, 0.0, 1.0) : 0.0;
    points.col(i) = (1 - part) * vertices.col(next - 1) + part * vertices.col(next);
  }
  return points;
}

}  // namespace pulson::io
