#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include "plane_cell.hpp"

namespace pulson {

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

}  // namespace pulson
