#pragma once

#include <array>
#include <cstddef>

namespace pulson {

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

}  // namespace pulson
