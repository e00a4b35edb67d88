#include "warp/deformed_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct RowFolds {
  std::int64_t reversed = 0;
  std::int64_t triangles = 0;
  double min_jacobian = kInfinity;
  double max_jacobian = -kInfinity;

  void add(double jacobian) {
    reversed += jacobian < 0 ? 1 : 0;
    ++triangles;
    min_jacobian = std::min(min_jacobian, jacobian);
    max_jacobian = std::max(max_jacobian, jacobian);
  }
};

RowFolds folds_of_row(const DeformedMesh& mesh, int row, std::uint8_t* reversed_in_cell) {
  RowFolds folds;
  for (int column = 0; column < mesh.cell_columns(); ++column) {
    const std::array<double, 2> jacobians = {triangle_jacobian(mesh, column, row, 0),
                                             triangle_jacobian(mesh, column, row, 1)};
    if (!std::isfinite(jacobians[0] + jacobians[1])) continue;
    for (const double jacobian : jacobians) {
      folds.add(jacobian);
      if (jacobian < 0) ++reversed_in_cell[column];
    }
  }
  return folds;
}

MeshFolds sum_of_rows(const std::vector<RowFolds>& rows) {
  RowFolds all;
  for (const RowFolds& row : rows) {
    all.reversed += row.reversed;
    all.triangles += row.triangles;
    all.min_jacobian = std::min(all.min_jacobian, row.min_jacobian);
    all.max_jacobian = std::max(all.max_jacobian, row.max_jacobian);
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (all.triangles == 0) return {0, 0, 0, nan, nan, {}};
  return {static_cast<double>(all.reversed) / static_cast<double>(all.triangles),
          all.reversed,
          all.triangles,
          all.min_jacobian,
          all.max_jacobian,
          {}};
}

}  // namespace

void DeformedMesh::check() const {
  const std::string size = std::to_string(columns) + " x " + std::to_string(rows);
  if (columns < 2 || rows < 2) throw InputError("mesh of " + size + " vertices: at least 2 x 2 are needed");
  if (vertices.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows))
    throw InputError("mesh of " + size + " vertices has " + std::to_string(vertices.size()) + " of them");
}

double triangle_jacobian(const DeformedMesh& mesh, int column, int row, std::size_t triangle) {
  const auto& corners = kCellTriangles[triangle];
  const auto vertex = [&](std::size_t i) -> const std::array<float, 2>& {
    return mesh.at(column + corners[i][0], row + corners[i][1]);
  };
  const auto& a = vertex(0);
  const auto edge = [&](std::size_t i, std::size_t axis) {
    return static_cast<double>(vertex(i)[axis]) - static_cast<double>(a[axis]);
  };
  return edge(1, 0) * edge(2, 1) - edge(1, 1) * edge(2, 0);
}

MeshFolds mesh_folds(const DeformedMesh& mesh) {
  mesh.check();
  const auto columns = static_cast<std::size_t>(mesh.cell_columns());
  const auto rows = static_cast<std::size_t>(mesh.cell_rows());
  std::vector<std::uint8_t> reversed_in_cell(columns * rows, 0);
  std::vector<RowFolds> folds(rows);
  parallel_for(mesh.cell_rows(), [&](int row) {
    const auto r = static_cast<std::size_t>(row);
    folds[r] = folds_of_row(mesh, row, reversed_in_cell.data() + r * columns);
  });
  MeshFolds sum = sum_of_rows(folds);
  sum.reversed_in_cell = std::move(reversed_in_cell);
  return sum;
}

}  // namespace pulson
