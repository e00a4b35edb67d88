#include "vtk_cells.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::io {
namespace {

/// `count point point ...` of each cell, `size` numbers in all: to version 4.2.
void take_counted(VtkCursor& cursor, VtkCells& cells, std::size_t count, std::size_t size) {
  const std::vector<VtkId> numbers = take_vtk_ids(cursor, cells.section, vtk_int(), size);
  const std::string title = in_quotes(cells.section.text);
  std::size_t next = 0;
  cells.begins = {0};
  for (std::size_t c = 0; c < count; ++c) {
    const VtkId length = next < size ? numbers[next++] : -1;
    if (length < 0 || static_cast<std::size_t>(length) > size - next)
      cursor.fail_at(cells.section.place, fmt::format("cell {} of {} does not fit into its numbers", c, title));
    const auto begin = numbers.begin() + static_cast<std::ptrdiff_t>(next);
    cells.points.insert(cells.points.end(), begin, begin + length);
    cells.begins.push_back(std::ssize(cells.points));
    next += static_cast<std::size_t>(length);
  }
  if (next != size)
    cursor.fail_at(cells.section.place, fmt::format("the cells of {} take {} of its numbers", title, next));
}

std::vector<VtkId> take_named(VtkCursor& cursor, std::string_view name, std::size_t count) {
  const std::string_view word = cursor.take_word();
  const VtkPlace place = cursor.place();
  if (to_lower(word) != to_lower(name)) cursor.fail_here(fmt::format("{} where {} is expected", in_quotes(word), name));
  const VtkType& type = take_vtk_type(cursor, name);
  return take_vtk_ids(cursor, {place, fmt::format("{} {}", name, type.name)}, type, count);
}

/// OFFSETS of the cells, one more than there are, and CONNECTIVITY: from version 5.0.
void take_with_offsets(VtkCursor& cursor, VtkCells& cells, std::size_t begins, std::size_t points) {
  cells.begins = take_named(cursor, "OFFSETS", begins);
  cells.points = take_named(cursor, "CONNECTIVITY", points);
  if (cells.begins.empty()) cells.begins = {0};
  if (cells.begins.front() != 0 || cells.begins.back() != std::ssize(cells.points) ||
      !std::is_sorted(cells.begins.begin(), cells.begins.end()))
    cursor.fail_at(cells.section.place,
                   fmt::format("the offsets of {} do not rise from 0 to {}", in_quotes(cells.section.text), points));
}

bool joins_points(const VtkCells& cells) { return cells.are_lines() || cells.keyword == "polygons"; }

/// Sets of points that grow together.
class PointSets {
 public:
  explicit PointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t root(std::size_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }

  void join(std::size_t a, std::size_t b) { parent_[root(b)] = root(a); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace

VtkCells take_vtk_cells(VtkCursor& cursor, std::string_view keyword) {
  VtkCells cells{{cursor.place(), ""}, to_lower(keyword)};
  const std::size_t first = take_vtk_count(cursor, keyword);
  const std::size_t second = take_vtk_count(cursor, keyword);
  cells.section.text = fmt::format("{} {} {}", keyword, first, second);
  if (cursor.is_next("offsets"))
    take_with_offsets(cursor, cells, first, second);
  else
    take_counted(cursor, cells, first, second);
  return cells;
}

void check_vtk_points(const VtkCursor& cursor, const VtkCells& cells, std::size_t count) {
  const auto outside = std::find_if(cells.points.begin(), cells.points.end(), [count](VtkId point) {
    return point < 0 || static_cast<std::size_t>(point) >= count;
  });
  if (outside == cells.points.end()) return;
  const auto after = std::upper_bound(cells.begins.begin(), cells.begins.end(), outside - cells.points.begin());
  cursor.fail_at(cells.section.place, fmt::format("cell {} of {} has the point {}; there are {}, counted from 0",
                                                  after - cells.begins.begin() - 1, in_quotes(cells.section.text),
                                                  *outside, counted(count, "point")));
}

std::vector<std::size_t> vtk_pieces(const std::vector<VtkCells>& sections, std::size_t count) {
  PointSets sets(count);
  for (const VtkCells& cells : sections)
    if (joins_points(cells)) cells.visit_edges([&](std::size_t a, std::size_t b) { sets.join(a, b); });
  std::vector<std::size_t> piece_of_root(count);
  std::size_t last = 0;
  for (const VtkCells& cells : sections)
    for (std::size_t i = 0; i < cells.points.size() && joins_points(cells); ++i)
      if (std::size_t& piece = piece_of_root[sets.root(static_cast<std::size_t>(cells.points[i]))]; piece == 0)
        piece = ++last;
  std::vector<std::size_t> pieces(count);
  for (std::size_t a = 0; a < count; ++a) pieces[a] = piece_of_root[sets.root(a)];
  return pieces;
}

bool vtk_lines_follow_points(const std::vector<VtkCells>& sections, const std::vector<std::size_t>& pieces) {
  std::vector<std::size_t> size(pieces.size() + 1);
  std::vector<std::size_t> rank(pieces.size());
  for (std::size_t a = 0; a < pieces.size(); ++a) rank[a] = size[pieces[a]]++;
  bool follow = true;
  for (const VtkCells& cells : sections)
    if (cells.are_lines())
      cells.visit_edges([&](std::size_t a, std::size_t b) {
        const std::size_t apart = std::max(rank[a], rank[b]) - std::min(rank[a], rank[b]);
        if (apart > 1 && apart + 1 != size[pieces[a]]) follow = false;
      });
  return follow;
}

}  // namespace pulson::io
