#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "pulson/warp/sampled_map.hpp"

namespace pulson::warp {

/// The nodes first to last of a row or column.
struct NodeRange {
  int first = 0;
  int last = 0;

  int length() const { return last - first; }
  int middle() const { return first + length() / 2; }
  /// Of a node, from 0 at the first to 1 at the last.
  double fraction(int node) const { return length() > 0 ? static_cast<double>(node - first) / length() : 0; }
  int halves() const { return length() > 1 ? 2 : 1; }
  /// @param index 0, or 1 where there are two
  NodeRange half(int index) const {
    if (halves() == 1) return *this;
    return index == 0 ? NodeRange{first, middle()} : NodeRange{middle(), last};
  }
};

struct Node {
  int column = 0;
  int row = 0;
};

/// A rectangle with nodes as corners.
struct PlaneCell {
  NodeRange columns;
  NodeRange rows;

  Node middle() const { return {columns.middle(), rows.middle()}; }
  /// Row by row: first and last columns of the first row, of the last row.
  std::array<Node, 4> corners() const {
    return {{{columns.first, rows.first},
             {columns.last, rows.first},
             {columns.first, rows.last},
             {columns.last, rows.last}}};
  }
  /// The corners of its quarters, row by row; some coincide where a side is shorter than two.
  std::array<Node, 9> lattice() const {
    std::array<Node, 9> nodes;
    std::size_t count = 0;
    for (const int row : {rows.first, rows.middle(), rows.last})
      for (const int column : {columns.first, columns.middle(), columns.last}) nodes[count++] = {column, row};
    return nodes;
  }
  /// The quarter of a half of the columns and one of the rows.
  PlaneCell quarter(int column, int row) const { return {columns.half(column), rows.half(row)}; }
  /// Calls visit(quarter) for each, row by row.
  template <class Visit>
  void for_each_quarter(const Visit& visit) const {
    for (int row = 0; row < rows.halves(); ++row)
      for (int column = 0; column < columns.halves(); ++column) visit(quarter(column, row));
  }
  /// Whether all of its nodes are corners.
  bool is_smallest() const { return columns.length() <= 1 && rows.length() <= 1; }
  /// Whether that is so for its quarters.
  bool has_smallest_quarters() const { return columns.length() <= 2 && rows.length() <= 2; }
};

using PlaneVector = Eigen::Array2d;

/// An exact value of a map of the plane.
struct ExactPlace {
  PlaneVector place;
  PlaneVector by_x;  ///< ∂place/∂x
  PlaneVector by_y;

  bool has_place() const { return place.isFinite().all(); }
  bool has_value() const { return has_place() && by_x.isFinite().all() && by_y.isFinite().all(); }
  double jacobian() const { return by_x[0] * by_y[1] - by_x[1] * by_y[0]; }
};

/// Coefficients of 1, t, t², t³.
using Cubic = std::array<PlaneVector, 4>;

inline PlaneVector value_of(const Cubic& c, double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
inline PlaneVector slope_of(const Cubic& c, double t) { return c[1] + t * (2 * c[2] + (3 * t) * c[3]); }

/// Adini's element on a cell, in u and v from 0 to 1 along columns and rows. With the cubics E that have the values and
/// slopes of the edge's two corners,
///
///     P(u, v) = (1−v) E_top(u) + v E_bottom(u) + (1−u) E_left(v) + u E_right(v) − bilinear in the corners' values
class CellPlaces {
 public:
  /// @param corners in the order of PlaneCell::corners
  CellPlaces(const PlaneCell& cell, const std::array<const ExactPlace*, 4>& corners);

  /// The cubic in u at some v.
  Cubic row(double v) const;

  /// How far an exact value is off.
  struct Difference {
    double place;  ///< pixels
    double slope;  ///< of the gradient, times the sides of the cell: pixels
  };
  Difference difference(const Node& node, const ExactPlace& exact) const;

 private:
  PlaneCell cell_;
  std::array<Cubic, 4> by_power_of_u_;  ///< cubics in v
};

/// The biquadratic with given values on the lattice of a cell; linear or constant along sides of 1 or 0.
class CellJacobians {
 public:
  using Row = std::array<double, 3>;  ///< by power of u

  /// @param values in the order of PlaneCell::lattice
  CellJacobians(const PlaneCell& cell, const std::array<double, 9>& values);

  Row row(double v) const;
  double value_at(const PlaneCell& cell, const Node& node) const {
    return value_of(row(cell.rows.fraction(node.row)), cell.columns.fraction(node.column));
  }
  static double value_of(const Row& row, double u) { return row[0] + u * (row[1] + u * row[2]); }

 private:
  std::array<Row, 3> by_power_of_v_;
};

/// What the cells are halved for.
struct RefinementGoal {
  double tolerance = 0;  ///< pixels
  bool with_jacobians = false;
};

/// The cells between two rows of nodes, halved until interpolation in their quarters meets the goal.
class RefinedCells {
 public:
  /// @param cells that fill columns 0 to plane.columns − 1 and `rows`
  RefinedCells(const PlaneMap& map, const SampledPlane& plane, const NodeRange& rows, const RefinementGoal& goal,
               std::vector<PlaneCell> cells);

  /// The cells in the end, whose lattices are known.
  const std::vector<PlaneCell>& cells() const { return done_; }
  /// Of a node of one of their lattices.
  const ExactPlace& exact(const Node& node) const;
  CellPlaces places(const PlaneCell& cell) const;
  CellJacobians jacobians(const PlaneCell& cell) const;

  /// Largest differences from the exact map at the middles of their quarters.
  double error() const { return error_; }
  double jacobian_error() const { return jacobian_error_; }
  std::int64_t evaluations() const { return static_cast<std::int64_t>(known_.size()); }

 private:
  struct Tested {
    bool passed;
    double error, jacobian_error;
  };

  std::vector<PlaneCell> unfinished_quarters(const PlaneMap& map, double first, std::vector<PlaneCell> cells);
  bool finish(const PlaneCell& cell);
  std::size_t index_of(const Node& node) const;
  void ask(const Node& node);
  void answer(const PlaneMap& map, double first);
  bool may_pass(const PlaneCell& cell) const;
  Tested test_quarters(const PlaneCell& cell) const;
  Tested test_quarter(const PlaneCell& quarter, const CellJacobians* jacobians, const PlaneCell& cell) const;
  bool has_values(const PlaneCell& cell) const;
  bool has_no_places(const PlaneCell& cell) const;

  NodeRange rows_;
  std::size_t columns_;
  RefinementGoal goal_;
  std::vector<std::int32_t> numbers_;  ///< of nodes in known_; −1 for none
  std::vector<Node> asked_;            ///< known after the next answer
  std::vector<ExactPlace> known_;
  std::vector<PlaneCell> done_;
  double error_ = 0;
  double jacobian_error_ = 0;
};

}  // namespace pulson::warp
