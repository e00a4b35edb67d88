#include "grid.hpp"

#include <algorithm>
#include <cmath>

namespace pulson {
namespace {

constexpr double kMargin = 0.12;  // of the larger side of the box

// Points at `count` equal distances from `low` to `high`.
Eigen::VectorXd even(double low, double high, int count) { return Eigen::VectorXd::LinSpaced(count, low, high); }

}  // namespace

std::pair<Eigen::VectorXd, Eigen::VectorXd> drawn_box(const Registration& registration) {
  const Eigen::Index n = registration.result.cols(), m = registration.target.points.cols();
  Points all(registration.result.rows(), 2 * n + m);
  all << registration.source.points, registration.target.points, registration.result;
  const auto [low, high] = bounding_box(all);  // of the points that miss no coordinate
  const double side = std::max((high - low).maxCoeff(), 1e-300);
  return {low.array() - kMargin * side, high.array() + kMargin * side};
}

std::vector<Points> grid_lines(const Eigen::Vector2d& low, const Eigen::Vector2d& high, int cells,
                               int points_per_cell) {
  const double cell = (high - low).maxCoeff() / cells;
  std::vector<Points> lines;
  for (int axis = 0; axis < 2; ++axis) {
    const int along = 1 - axis;
    const int count = static_cast<int>(std::lround((high[axis] - low[axis]) / cell)) + 1;
    const int samples = static_cast<int>(std::lround((high[along] - low[along]) / cell)) * points_per_cell + 1;
    for (const double place : even(low[axis], high[axis], std::max(count, 2))) {
      Points line(2, std::max(samples, 2));
      line.row(axis).setConstant(place);
      line.row(along) = even(low[along], high[along], static_cast<int>(line.cols())).transpose();
      lines.push_back(line);
    }
  }
  return lines;
}

Points joined_lines(const std::vector<Points>& lines) {
  Eigen::Index count = 0;
  for (const Points& line : lines) count += line.cols();
  Points points(2, count);
  Eigen::Index column = 0;
  for (const Points& line : lines) {
    points.middleCols(column, line.cols()) = line;
    column += line.cols();
  }
  return points;
}

std::vector<Points> split_lines(const Points& points, const std::vector<Points>& lines) {
  std::vector<Points> split;
  Eigen::Index column = 0;
  for (const Points& line : lines) {
    split.emplace_back(points.middleCols(column, line.cols()));
    column += line.cols();
  }
  return split;
}

}  // namespace pulson
