#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "vtk_numbers.hpp"

namespace pulson::io {

/// The cells of one section of a VTK file.
struct VtkCells {
  VtkBlock section;
  std::string keyword;             ///< in lower case
  std::vector<VtkId> begins = {};  ///< of each cell in `points`, and the end
  std::vector<VtkId> points = {};

  std::size_t count() const { return begins.size() - 1; }
  bool are_lines() const { return keyword == "lines"; }

  /// Calls visit(a, b) for all points that follow each other in a line or polygon; a polygon's last and first do not.
  template <class Visit>
  void visit_edges(const Visit& visit) const {
    for (std::size_t c = 0; c < count(); ++c)
      for (auto i = static_cast<std::size_t>(begins[c] + 1); i < static_cast<std::size_t>(begins[c + 1]); ++i)
        visit(static_cast<std::size_t>(points[i - 1]), static_cast<std::size_t>(points[i]));
  }
};

/// The section after its `keyword`. @throws InputError
VtkCells take_vtk_cells(VtkCursor& cursor, std::string_view keyword);

/// @throws InputError if a cell has a point that is none of the `count` ones
void check_vtk_points(const VtkCursor& cursor, const VtkCells& cells, std::size_t count);

/// Of each of `count` points the number of the piece that lines and polygons join it to, from 1 in the order of the
/// cells; 0 where it is in none.
std::vector<std::size_t> vtk_pieces(const std::vector<VtkCells>& sections, std::size_t count);

/// Whether each line joins neighbours in the order of its piece's points, or the last and the first.
bool vtk_lines_follow_points(const std::vector<VtkCells>& sections, const std::vector<std::size_t>& pieces);

}  // namespace pulson::io
