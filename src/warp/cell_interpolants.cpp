#include "cell_interpolants.hpp"

#include <cmath>

namespace pulson {
namespace {

// With values a, b and slopes at t = 0, 1.
Cubic edge(const PlaneVector& a, const PlaneVector& a_slope, const PlaneVector& b, const PlaneVector& b_slope) {
  const PlaneVector rise = b - a;
  return {a, a_slope, 3 * rise - 2 * a_slope - b_slope, a_slope + b_slope - 2 * rise};
}

// The parabola through values at 0, middle, 1; a line or constant where there are no three different nodes.
CellJacobians::Row parabola(const NodeRange& range, double first, double middle, double last) {
  if (range.halves() == 1) return {first, last - first, 0};
  const double t = range.fraction(range.middle());
  const double bend = ((last - first) - (middle - first) / t) / (1 - t);
  return {first, last - first - bend, bend};
}

}  // namespace

CellPlaces::CellPlaces(const PlaneCell& cell, const std::array<const ExactPlace*, 4>& corners) : cell_(cell) {
  const double width = cell.columns.length();
  const double height = cell.rows.length();
  const auto along_x = [&](const ExactPlace& a, const ExactPlace& b) {
    return edge(a.place, width * a.by_x, b.place, width * b.by_x);
  };
  const auto along_y = [&](const ExactPlace& a, const ExactPlace& b) {
    return edge(a.place, height * a.by_y, b.place, height * b.by_y);
  };
  const Cubic top = along_x(*corners[0], *corners[1]);
  const Cubic bottom = along_x(*corners[2], *corners[3]);
  const Cubic left = along_y(*corners[0], *corners[2]);
  const Cubic right = along_y(*corners[1], *corners[3]);
  for (Cubic& cubic : by_power_of_u_) cubic.fill(PlaneVector::Zero());
  for (std::size_t k = 0; k < 4; ++k) {
    by_power_of_u_[k][0] += top[k];
    by_power_of_u_[k][1] += bottom[k] - top[k];
    by_power_of_u_[0][k] += left[k];
    by_power_of_u_[1][k] += right[k] - left[k];
  }
  by_power_of_u_[0][0] -= top[0];
  by_power_of_u_[1][0] -= right[0] - top[0];
  by_power_of_u_[0][1] -= bottom[0] - top[0];
  by_power_of_u_[1][1] -= corners[3]->place - right[0] - bottom[0] + top[0];
}

Cubic CellPlaces::row(double v) const {
  Cubic result;
  for (std::size_t k = 0; k < 4; ++k) result[k] = value_of(by_power_of_u_[k], v);
  return result;
}

CellPlaces::Difference CellPlaces::difference(const Node& node, const ExactPlace& exact) const {
  const double u = cell_.columns.fraction(node.column);
  const double v = cell_.rows.fraction(node.row);
  Cubic slopes;
  for (std::size_t k = 0; k < 4; ++k) slopes[k] = slope_of(by_power_of_u_[k], v);
  const Cubic row = this->row(v);
  const PlaneVector by_u = slope_of(row, u) - cell_.columns.length() * exact.by_x;
  const PlaneVector by_v = value_of(slopes, u) - cell_.rows.length() * exact.by_y;
  return {(value_of(row, u) - exact.place).matrix().norm(),
          std::sqrt(by_u.matrix().squaredNorm() + by_v.matrix().squaredNorm())};
}

CellJacobians::CellJacobians(const PlaneCell& cell, const std::array<double, 9>& values) {
  std::array<Row, 3> rows;
  for (std::size_t r = 0; r < 3; ++r)
    rows[r] = parabola(cell.columns, values[3 * r], values[3 * r + 1], values[3 * r + 2]);
  for (std::size_t k = 0; k < 3; ++k) {
    const Row by_v = parabola(cell.rows, rows[0][k], rows[1][k], rows[2][k]);
    for (std::size_t l = 0; l < 3; ++l) by_power_of_v_[l][k] = by_v[l];
  }
}

CellJacobians::Row CellJacobians::row(double v) const {
  Row result;
  for (std::size_t k = 0; k < 3; ++k)
    result[k] = by_power_of_v_[0][k] + v * (by_power_of_v_[1][k] + v * by_power_of_v_[2][k]);
  return result;
}

}  // namespace pulson
