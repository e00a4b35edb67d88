#include "pulson/warp/sampled_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "refined_cells.hpp"

namespace pulson::warp {
namespace {

constexpr std::int64_t kMaxNodes = std::int64_t{1} << 31;
// Nodes whose cells are refined together: many, as they share calls of the map; each takes 4 bytes, and 56 where it is
// exact.
constexpr std::int64_t kNodesPerBand = std::int64_t{1} << 21;
constexpr int kCellsPerTask = 16;

void check_input(const SampledPlane& plane, double tolerance, int coarsest) {
  const std::string size = std::to_string(plane.columns) + " x " + std::to_string(plane.rows);
  if (plane.columns < 1 || plane.rows < 1) throw InputError("plane of " + size + " nodes: sizes must be positive");
  if (std::int64_t{plane.columns} * plane.rows > kMaxNodes)
    throw InputError("plane of " + size + " nodes: at most " + std::to_string(kMaxNodes));
  if (!(tolerance > 0 && std::isfinite(tolerance)))
    throw InputError("tolerance " + std::to_string(tolerance) + " of the sampled map must be positive and finite");
  if (coarsest < 1) throw InputError("coarsest cell of " + std::to_string(coarsest) + " nodes must have at least one");
}

// Ranges of about the same length, at most `longest`, that share their ends; one of length 0 for a single node.
std::vector<NodeRange> ranges(int nodes, int longest) {
  const std::int64_t last = nodes - 1;
  const std::int64_t count = std::max<std::int64_t>(1, (last + longest - 1) / longest);
  std::vector<NodeRange> result;
  for (std::int64_t i = 0; i < count; ++i)
    result.push_back({static_cast<int>(i * last / count), static_cast<int>((i + 1) * last / count)});
  return result;
}

int rows_per_band(const SampledPlane& plane, int coarsest) {
  return std::max(coarsest, static_cast<int>(kNodesPerBand / plane.columns));
}

std::vector<PlaneCell> cells_of(const NodeRange& band, int columns, int coarsest) {
  const std::vector<NodeRange> across = ranges(columns, coarsest);
  std::vector<PlaneCell> cells;
  for (const NodeRange& rows : ranges(band.length() + 1, coarsest))
    for (const NodeRange& range : across) cells.push_back({range, {band.first + rows.first, band.first + rows.last}});
  return cells;
}

// Writes the nodes of the cells, of which the last row and column belong to the next cell except at the plane's end.
class CellWriter {
 public:
  // The rows of `map` are those of the plane from `first_row` on.
  CellWriter(const RefinedCells& cells, const SampledPlane& plane, int first_row, SampledMap& map)
      : cells_(cells),
        plane_rows_(plane.rows),
        first_row_(first_row),
        map_(map),
        with_jacobians_(!map.jacobians.empty()) {}

  void write(const PlaneCell& cell) const {
    cell.for_each_quarter([&](const PlaneCell& quarter) {
      if (quarter.is_smallest())
        write_corners(quarter);
      else
        write_places(quarter);
    });
    if (with_jacobians_ && !cell.has_smallest_quarters()) write_jacobians(cell);
  }

 private:
  static int end(const NodeRange& range, int nodes) { return range.last == nodes - 1 ? nodes : range.last; }
  int end_column(const PlaneCell& cell) const { return end(cell.columns, map_.columns); }
  int end_row(const PlaneCell& cell) const { return end(cell.rows, plane_rows_); }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row - first_row_) * static_cast<std::size_t>(map_.columns) +
           static_cast<std::size_t>(column);
  }

  static std::array<float, 2> rounded(const PlaneVector& place) {
    return {static_cast<float>(place[0]), static_cast<float>(place[1])};
  }

  // Places may be known where gradients are not.
  void write_corners(const PlaneCell& cell) const {
    for (const Node& node : cell.corners()) {
      if (node.column >= end_column(cell) || node.row >= end_row(cell)) continue;
      const ExactPlace& exact = cells_.exact(node);
      map_.places[index(node.column, node.row)] = rounded(exact.place);
      if (with_jacobians_) map_.jacobians[index(node.column, node.row)] = static_cast<float>(exact.jacobian());
    }
  }

  void write_places(const PlaneCell& cell) const {
    const CellPlaces places = cells_.places(cell);
    for (int row = cell.rows.first; row < end_row(cell); ++row) {
      const Cubic cubic = places.row(cell.rows.fraction(row));
      std::array<float, 2>* to = &map_.places[index(cell.columns.first, row)];
      for (int column = cell.columns.first; column < end_column(cell); ++column)
        *to++ = rounded(value_of(cubic, cell.columns.fraction(column)));
    }
  }

  void write_jacobians(const PlaneCell& cell) const {
    const CellJacobians jacobians = cells_.jacobians(cell);
    for (int row = cell.rows.first; row < end_row(cell); ++row) {
      const CellJacobians::Row parabola = jacobians.row(cell.rows.fraction(row));
      float* to = &map_.jacobians[index(cell.columns.first, row)];
      for (int column = cell.columns.first; column < end_column(cell); ++column)
        *to++ = static_cast<float>(CellJacobians::value_of(parabola, cell.columns.fraction(column)));
    }
  }

  const RefinedCells& cells_;
  int plane_rows_;
  int first_row_;
  SampledMap& map_;
  bool with_jacobians_;
};

void write_cells(const RefinedCells& refined, const CellWriter& writer) {
  const std::vector<PlaneCell>& cells = refined.cells();
  const auto tasks = static_cast<int>((cells.size() + kCellsPerTask - 1) / kCellsPerTask);
  parallel_for(tasks, [&](int task) {
    const std::size_t first = static_cast<std::size_t>(task) * kCellsPerTask;
    for (std::size_t i = first; i < std::min(first + kCellsPerTask, cells.size()); ++i) writer.write(cells[i]);
  });
}

// Neighbouring bands share a row of nodes, which is written with the latter.
SampledMap sample_band(const PlaneMap& map, const SampledPlane& plane, const NodeRange& band,
                       const RefinementGoal& goal, int coarsest) {
  const int rows = band.length() + (band.last == plane.rows - 1 ? 1 : 0);
  const std::size_t nodes = static_cast<std::size_t>(plane.columns) * static_cast<std::size_t>(rows);
  SampledMap result{plane.columns, rows, {}, {}};
  result.places.resize(nodes);
  if (goal.with_jacobians) result.jacobians.resize(nodes);
  const RefinedCells refined(map, plane, band, goal, cells_of(band, plane.columns, coarsest));
  write_cells(refined, CellWriter(refined, plane, band.first, result));
  result.error = refined.error();
  if (goal.with_jacobians) result.jacobian_error = refined.jacobian_error();
  result.exact_fraction = static_cast<double>(refined.evaluations()) / static_cast<double>(nodes);
  return result;
}

}  // namespace

void sample_map_by_rows(const PlaneMap& map, const SampledPlane& plane, double tolerance, bool with_jacobians,
                        const UseRows& use, int coarsest) {
  check_input(plane, tolerance, coarsest);
  for (const NodeRange& band : ranges(plane.rows, rows_per_band(plane, coarsest)))
    use(band.first, sample_band(map, plane, band, {tolerance, with_jacobians}, coarsest));
}

SampledMap sample_map(const PlaneMap& map, const SampledPlane& plane, double tolerance, bool with_jacobians,
                      int coarsest) {
  check_input(plane, tolerance, coarsest);
  const std::size_t nodes = static_cast<std::size_t>(plane.columns) * static_cast<std::size_t>(plane.rows);
  SampledMap result{plane.columns, plane.rows, {}, {}};
  result.places.reserve(nodes);
  if (with_jacobians) result.jacobians.reserve(nodes);
  const UseRows append = [&](int, SampledMap&& band) {
    const double share = static_cast<double>(band.places.size()) / static_cast<double>(nodes);
    result.places.insert(result.places.end(), band.places.begin(), band.places.end());
    result.jacobians.insert(result.jacobians.end(), band.jacobians.begin(), band.jacobians.end());
    result.error = std::max(result.error, band.error);
    result.jacobian_error = std::max(result.jacobian_error, band.jacobian_error);
    result.exact_fraction += share * band.exact_fraction;
  };
  sample_map_by_rows(map, plane, tolerance, with_jacobians, append, coarsest);
  return result;
}

}  // namespace pulson::warp
