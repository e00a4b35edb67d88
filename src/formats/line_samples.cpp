#include "line_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pulson/core/errors.hpp"

namespace pulson::io {
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
