#include "split_cells.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "pulson/core/parallel.hpp"

namespace pulson::warp {
namespace {

constexpr int kHalvings = kMostBisections / 2;
constexpr std::int64_t kUnitsPerCell = std::int64_t{1} << kHalvings;

/// A place of the source, in fractions of a cell.
struct Corner {
  std::int64_t x, y;

  bool is_of_a_cell() const { return x % kUnitsPerCell == 0 && y % kUnitsPerCell == 0; }
};

/// Right-angled at the apex, with its longest side from a to b.
struct BisectedTriangle {
  Corner apex, a, b;
  int level = 0;

  std::array<Corner, 3> corners() const { return {apex, a, b}; }
};

bool has_middle(const Corner& a, const Corner& b) { return (a.x + b.x) % 2 == 0 && (a.y + b.y) % 2 == 0; }
Corner middle(const Corner& a, const Corner& b) { return {(a.x + b.x) / 2, (a.y + b.y) / 2}; }

// What the map does to a corner.
struct MappedCorner {
  std::array<float, 2> place;
  bool reversed;
};

// Whether a triangle has the other orientation than the map has at all of its corners.
bool contradicts(const std::array<MappedCorner, 3>& corners) {
  const auto& [a, b, c] = corners;
  if (a.reversed != b.reversed || a.reversed != c.reversed) return false;
  const auto edge = [&a = a](const MappedCorner& to, std::size_t axis) {
    return static_cast<double>(to.place[axis]) - static_cast<double>(a.place[axis]);
  };
  const double doubled_area = edge(b, 0) * edge(c, 1) - edge(b, 1) * edge(c, 0);
  return a.reversed ? doubled_area > 0 : doubled_area < 0;
}

class CellSplitter {
 public:
  CellSplitter(const PlaneMap& map, const std::vector<bool>& reversed, DeformedMesh& mesh, std::size_t most)
      : map_(map), reversed_(reversed), mesh_(mesh), most_(most) {}

  void run() {
    std::vector<std::int64_t> cells = suspected_cells();
    if (kCellTriangles.size() * cells.size() > most_) return;
    for (const std::int64_t cell : cells) touch(cell);
    answer();
    while (!cells.empty() && triangles_ < most_) {
      for (const std::int64_t cell : cells) bisect_contradicting(cell);
      cells = close();
      answer();
    }
    write();
  }

 private:
  std::int64_t cell_columns() const { return mesh_.cell_columns(); }
  std::int64_t key(const Corner& corner) const { return corner.y * (mesh_.columns * kUnitsPerCell) + corner.x; }

  std::size_t vertex_index(const Corner& corner) const {
    return static_cast<std::size_t>(corner.y / kUnitsPerCell * mesh_.columns + corner.x / kUnitsPerCell);
  }
  const std::array<float, 2>& place(const Corner& corner) const {
    return corner.is_of_a_cell() ? mesh_.vertices[vertex_index(corner)] : known_.at(key(corner)).place;
  }
  MappedCorner mapped(const Corner& corner) const { return {place(corner), known_.at(key(corner)).reversed}; }
  bool contradicts(const BisectedTriangle& triangle) const {
    return warp::contradicts({mapped(triangle.apex), mapped(triangle.a), mapped(triangle.b)});
  }

  static std::array<BisectedTriangle, 2> triangles_of(std::int64_t column, std::int64_t row) {
    const auto corner = [&](const std::array<int, 2>& offset) {
      return Corner{(column + offset[0]) * kUnitsPerCell, (row + offset[1]) * kUnitsPerCell};
    };
    std::array<BisectedTriangle, 2> triangles;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& [apex, a, b] = kCellTriangles[i];
      triangles[i] = {corner(apex), corner(a), corner(b)};
    }
    return triangles;
  }

  // Those with a triangle that has the other orientation than the map has in the middle.
  std::vector<std::int64_t> suspected_cells() const {
    std::vector<std::vector<std::int64_t>> of_rows(static_cast<std::size_t>(mesh_.cell_rows()));
    parallel_for(mesh_.cell_rows(), [&](int row) {
      for (int column = 0; column < mesh_.cell_columns(); ++column) {
        const std::int64_t cell = row * cell_columns() + column;
        const bool reversed = reversed_[static_cast<std::size_t>(cell)];
        const auto corner = [&](const std::array<int, 2>& offset) {
          return MappedCorner{mesh_.at(column + offset[0], row + offset[1]), reversed};
        };
        const auto is_suspected = [&](const auto& triangle) {
          return warp::contradicts({corner(triangle[0]), corner(triangle[1]), corner(triangle[2])});
        };
        if (is_suspected(kCellTriangles[0]) || is_suspected(kCellTriangles[1]))
          of_rows[static_cast<std::size_t>(row)].push_back(cell);
      }
    });
    std::vector<std::int64_t> cells;
    for (const auto& row : of_rows) cells.insert(cells.end(), row.begin(), row.end());
    return cells;
  }

  std::vector<BisectedTriangle>& touch(std::int64_t cell) {
    const auto [found, is_new] = split_.try_emplace(cell);
    if (is_new)
      for (const BisectedTriangle& triangle : triangles_of(cell % cell_columns(), cell / cell_columns())) {
        found->second.push_back(triangle);
        ++triangles_;
        for (const Corner& corner : triangle.corners()) ask(corner);
      }
    return found->second;
  }

  void bisect_contradicting(std::int64_t cell) {
    for (const BisectedTriangle& triangle : split_.at(cell))
      if (triangle.level < kMostBisections && contradicts(triangle)) add(middle(triangle.a, triangle.b));
  }

  // What the map does to a corner is known after answer(). False where that was asked before.
  bool ask(const Corner& corner) {
    if (!known_.try_emplace(key(corner)).second) return false;
    asked_.push_back(corner);
    return true;
  }

  // A corner of the mesh from now on.
  void add(const Corner& corner) {
    if (!ask(corner)) return;
    const std::int64_t right = corner.x / kUnitsPerCell, below = corner.y / kUnitsPerCell;
    const std::int64_t left = corner.x % kUnitsPerCell == 0 ? right - 1 : right;
    const std::int64_t above = corner.y % kUnitsPerCell == 0 ? below - 1 : below;
    for (std::int64_t row = std::max<std::int64_t>(above, 0);
         row <= std::min<std::int64_t>(below, mesh_.cell_rows() - 1); ++row)
      for (std::int64_t column = std::max<std::int64_t>(left, 0); column <= std::min(right, cell_columns() - 1);
           ++column)
        open_.push_back(row * cell_columns() + column);
  }

  bool has_corner_between(const Corner& a, const Corner& b) const {
    return has_middle(a, b) && known_.contains(key(middle(a, b)));
  }

  // Bisects triangles with a corner on one of their sides, which may put others onto sides of more triangles. Returns
  // the cells that have changed.
  std::vector<std::int64_t> close() {
    std::vector<std::int64_t> changed;
    while (!open_.empty()) {
      const std::int64_t cell = open_.back();
      open_.pop_back();
      std::vector<BisectedTriangle>& triangles = touch(cell);
      const std::size_t before = triangles.size();
      for (std::size_t i = 0; i < triangles.size();) {
        const auto [apex, a, b, level] = triangles[i];
        if (!has_corner_between(a, b) && !has_corner_between(apex, a) && !has_corner_between(b, apex)) {
          ++i;
          continue;
        }
        const Corner m = middle(a, b);
        triangles[i] = {m, apex, a, level + 1};
        triangles.push_back({m, b, apex, level + 1});
        ++triangles_;
        add(m);
      }
      if (triangles.size() > before) changed.push_back(cell);
    }
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    return changed;
  }

  static std::array<double, 2> label(const Corner& corner) {
    constexpr double kCellsPerUnit = 1.0 / kUnitsPerCell;
    return {static_cast<double>(corner.x) * kCellsPerUnit - 0.5, static_cast<double>(corner.y) * kCellsPerUnit - 0.5};
  }

  void answer() {
    if (asked_.empty()) return;
    Points labels(2, static_cast<Eigen::Index>(asked_.size()));
    Eigen::Index i = 0;
    for (const Corner& corner : asked_) {
      const auto [x, y] = label(corner);
      labels.col(i++) << x, y;
    }
    const MovedPoints moved = map_(labels);
    const Eigen::VectorXd jacobians = moved.jacobians();
    i = 0;
    for (const Corner& corner : asked_) {
      known_.at(key(corner)) = {{static_cast<float>(moved.places(0, i)), static_cast<float>(moved.places(1, i))},
                                jacobians[i] < 0};
      ++i;
    }
    asked_.clear();
  }

  void write() {
    for (const auto& [cell, triangles] : split_) {
      if (triangles.size() == kCellTriangles.size()) continue;
      SplitCell split{static_cast<int>(cell % cell_columns()), static_cast<int>(cell / cell_columns()), {}};
      for (const BisectedTriangle& triangle : triangles) {
        MeshTriangle& mapped_triangle = split.triangles.emplace_back();
        std::size_t i = 0;
        for (const Corner& corner : triangle.corners()) {
          mapped_triangle.labels[i] = label(corner);
          mapped_triangle.places[i++] = place(corner);
        }
      }
      mesh_.split.push_back(std::move(split));
    }
    std::sort(mesh_.split.begin(), mesh_.split.end(), [](const SplitCell& a, const SplitCell& b) {
      return std::pair(a.row, a.column) < std::pair(b.row, b.column);
    });
  }

  const PlaneMap& map_;
  const std::vector<bool>& reversed_;
  DeformedMesh& mesh_;
  std::size_t most_;
  std::unordered_map<std::int64_t, std::vector<BisectedTriangle>> split_;  // by cell
  std::unordered_map<std::int64_t, MappedCorner> known_;
  std::size_t triangles_ = 0;  // of all these cells
  std::vector<Corner> asked_;
  std::vector<std::int64_t> open_;  // cells some of whose triangles may have a corner on a side
};

}  // namespace

void split_cells(const PlaneMap& map, const std::vector<bool>& reversed, DeformedMesh& mesh, std::size_t most) {
  CellSplitter(map, reversed, mesh, most).run();
}

}  // namespace pulson::warp
