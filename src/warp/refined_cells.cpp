#include "refined_cells.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "pulson/core/errors.hpp"

namespace pulson::warp {

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

namespace {

// A cell is worth a look at its quarters, whose error is about a sixteenth, where its own is at most this many
// tolerances.
constexpr double kWholeCell = 4;
// Of the tolerance, at the middle of a quarter: errors elsewhere in it may be larger.
constexpr double kQuarter = 0.5;
// Differences of slopes find kinks and spots that pass where values agree by chance. For smooth maps they are O(h⁴)
// like those of places: at corners of quarters, where slopes across edges are off, this share makes them no stricter.
constexpr double kSlopeShare = 0.25;
// At middles of quarters the leading error has no slope, so that more costs smooth maps nothing. With half of this,
// kinks were off by 1.2 tolerances.
constexpr double kMiddleSlopeShare = 2;
// Pixels over which an error of the gradient amounts to one of the place.
constexpr double kJacobianLength = 5;

}  // namespace

RefinedCells::RefinedCells(const PlaneMap& map, const SampledPlane& plane, const NodeRange& rows,
                           const RefinementGoal& goal, std::vector<PlaneCell> cells)
    : rows_(rows), columns_(static_cast<std::size_t>(plane.columns)), goal_(goal) {
  numbers_.assign(columns_ * static_cast<std::size_t>(rows.length() + 1), -1);
  while (!cells.empty()) cells = unfinished_quarters(map, plane.first, std::move(cells));
}

// Finishes the cells that are good enough, and returns the quarters of the others.
std::vector<PlaneCell> RefinedCells::unfinished_quarters(const PlaneMap& map, double first,
                                                         std::vector<PlaneCell> cells) {
  for (const PlaneCell& cell : cells)
    for (const Node& node : cell.lattice()) ask(node);
  answer(map, first);
  const auto failed = std::partition(cells.begin(), cells.end(), [&](const PlaneCell& cell) { return may_pass(cell); });
  std::for_each(cells.begin(), failed, [&](const PlaneCell& cell) {
    if (!cell.has_smallest_quarters()) cell.for_each_quarter([&](const PlaneCell& quarter) { ask(quarter.middle()); });
  });
  answer(map, first);
  const auto bad = std::partition(cells.begin(), failed, [&](const PlaneCell& cell) { return finish(cell); });
  std::vector<PlaneCell> quarters;
  std::for_each(bad, cells.end(), [&](const PlaneCell& cell) {
    cell.for_each_quarter([&](const PlaneCell& quarter) { quarters.push_back(quarter); });
  });
  return quarters;
}

// Whether the cell is good enough; the middles of its quarters are known.
bool RefinedCells::finish(const PlaneCell& cell) {
  const Tested tested = test_quarters(cell);
  if (!tested.passed) return false;
  done_.push_back(cell);
  error_ = std::max(error_, tested.error);
  jacobian_error_ = std::max(jacobian_error_, tested.jacobian_error);
  return true;
}

std::size_t RefinedCells::index_of(const Node& node) const {
  return static_cast<std::size_t>(node.row - rows_.first) * columns_ + static_cast<std::size_t>(node.column);
}

const ExactPlace& RefinedCells::exact(const Node& node) const {
  return known_[static_cast<std::size_t>(numbers_[index_of(node)])];
}

void RefinedCells::ask(const Node& node) {
  std::int32_t& number = numbers_[index_of(node)];
  if (number >= 0) return;
  number = static_cast<std::int32_t>(known_.size() + asked_.size());
  asked_.push_back(node);
}

// All in one call, as that is what the map runs on all threads.
void RefinedCells::answer(const PlaneMap& map, double first) {
  if (asked_.empty()) return;
  const auto count = static_cast<Eigen::Index>(asked_.size());
  Points points(2, count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const Node& node = asked_[static_cast<std::size_t>(m)];
    points.col(m) << node.column + first, node.row + first;
  }
  const MovedPoints moved = map(points);
  if (moved.places.rows() != 2 || moved.places.cols() != count || moved.gradients.rows() != 4 ||
      moved.gradients.cols() != count)
    throw InputError("a map of the plane must give 2 coordinates and 4 entries of the gradient for each of " +
                     std::to_string(count) + " points");
  for (Eigen::Index m = 0; m < count; ++m)
    known_.push_back({moved.places.col(m), moved.gradients.col(m).head<2>(), moved.gradients.col(m).tail<2>()});
  asked_.clear();
}

CellPlaces RefinedCells::places(const PlaneCell& cell) const {
  std::array<const ExactPlace*, 4> corners{};
  std::size_t i = 0;
  for (const Node& node : cell.corners()) corners[i++] = &exact(node);
  return {cell, corners};
}

CellJacobians RefinedCells::jacobians(const PlaneCell& cell) const {
  std::array<double, 9> values{};
  std::size_t i = 0;
  for (const Node& node : cell.lattice()) values[i++] = exact(node).jacobian();
  return {cell, values};
}

bool RefinedCells::has_values(const PlaneCell& cell) const {
  const std::array<Node, 9> nodes = cell.lattice();
  return std::all_of(nodes.begin(), nodes.end(), [&](const Node& node) { return exact(node).has_value(); });
}

bool RefinedCells::has_no_places(const PlaneCell& cell) const {
  const std::array<Node, 9> nodes = cell.lattice();
  return std::none_of(nodes.begin(), nodes.end(), [&](const Node& node) { return exact(node).has_place(); });
}

// Whether the error in quarters may be small enough, by that of the whole cell on its lattice.
bool RefinedCells::may_pass(const PlaneCell& cell) const {
  if (cell.has_smallest_quarters() || has_no_places(cell)) return true;
  if (!has_values(cell)) return false;
  const CellPlaces places = this->places(cell);
  const std::array<Node, 9> nodes = cell.lattice();
  return std::all_of(nodes.begin(), nodes.end(), [&](const Node& node) {
    const CellPlaces::Difference difference = places.difference(node, exact(node));
    return std::max(difference.place, kSlopeShare * difference.slope) <= kWholeCell * goal_.tolerance;
  });
}

// The difference from the exact map at the middle of a quarter of a cell, which is known. @param jacobians none where
// the cell has no places
RefinedCells::Tested RefinedCells::test_quarter(const PlaneCell& quarter, const CellJacobians* jacobians,
                                                const PlaneCell& cell) const {
  const Node middle = quarter.middle();
  const ExactPlace& exact = this->exact(middle);
  if (jacobians == nullptr) return {!exact.has_place(), 0, 0};
  if (!exact.has_value()) return {false, 0, 0};
  const CellPlaces::Difference difference = places(quarter).difference(middle, exact);
  const double jacobian_error = std::abs(jacobians->value_at(cell, middle) - exact.jacobian());
  const double limit = kQuarter * goal_.tolerance;
  const bool passed = std::max(difference.place, kMiddleSlopeShare * difference.slope) <= limit &&
                      (!goal_.with_jacobians || jacobian_error * kJacobianLength <= limit);
  return {passed, difference.place, jacobian_error};
}

RefinedCells::Tested RefinedCells::test_quarters(const PlaneCell& cell) const {
  Tested all{true, 0, 0};
  if (cell.has_smallest_quarters()) return all;
  const CellJacobians jacobians = this->jacobians(cell);
  const bool with_values = has_values(cell);
  cell.for_each_quarter([&](const PlaneCell& quarter) {
    const Tested one = test_quarter(quarter, with_values ? &jacobians : nullptr, cell);
    all = {all.passed && one.passed, std::max(all.error, one.error), std::max(all.jacobian_error, one.jacobian_error)};
  });
  return all;
}

}  // namespace pulson::warp
