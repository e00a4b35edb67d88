#pragma once

// Blocks of numbers in VTK legacy files, as text or as big-endian bytes, and how to find them.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.hpp"

namespace pulson::formats {

/// The index of a point in its file, from 0.
using VtkId = std::int64_t;

/// A type of numbers, by its name in files.
struct VtkType {
  std::string_view name;
  std::size_t size;               ///< in bytes, where numbers are binary
  bool is_whole;                  ///< fit for ids
  double (*number)(const char*);  ///< at these bytes
  VtkId (*id)(const char*);
};

/// The type of numbers in cells that have none of their own.
const VtkType& vtk_int();

/// That of colours in binary files.
const VtkType& vtk_byte();

/// Where a message points to: the line from 1, in a binary file the byte from 0.
struct VtkPlace {
  std::size_t line = 1;
  std::size_t byte = 0;
};

/// Steps through a file, after a byte order mark: lines and words of text, blocks of bytes.
class VtkCursor {
 public:
  VtkCursor(const std::string& path, std::string_view text)
      : path_(path), text_(text), at_(text.size() - text::without_byte_order_mark(text).size()) {}

  bool is_binary = false;

  const std::string& path() const { return path_; }
  std::size_t left() const { return text_.size() - at_; }
  VtkPlace here() const { return {line_, at_}; }
  /// Of the line or word that was taken last.
  VtkPlace place() const { return place_; }

  /// The rest of the line, without its end.
  std::string_view take_line();

  /// The next word; nothing at the end.
  std::string_view take_word();

  /// `count` bytes; no more than left() may be asked for.
  const char* take_bytes(std::size_t count);

  /// Whether `word`, in lower case, comes next.
  bool is_next(std::string_view word) const;

  /// @throws InputError "path:line: message", for a binary file "path: byte n: message".
  [[noreturn]] void fail_at(VtkPlace place, const std::string& message) const;
  [[noreturn]] void fail_here(const std::string& message) const { fail_at(place_, message); }

 private:
  const std::string& path_;
  std::string_view text_;
  std::size_t at_;
  std::size_t line_ = 1;
  VtkPlace place_;
};

/// What the first line of a file begins with.
inline constexpr std::string_view kVtkMagic = "# vtk DataFile Version";

/// The lines before the sections, which say whether the file is binary.
/// @return `RAS` or `LPS` where the title says so as 3D Slicer does
/// @throws InputError unless the file is polydata of a version up to 5.1
std::string take_vtk_header(VtkCursor& cursor);

/// Goes past what follows FIELD: its name, a count and as many arrays. @throws InputError
void skip_vtk_field(VtkCursor& cursor);

/// Goes past what follows METADATA: lines to an empty one.
void skip_vtk_metadata(VtkCursor& cursor);

/// What announces a block of numbers.
struct VtkBlock {
  VtkPlace place;
  std::string text;  ///< "POINTS 80 float"
};

/// The next word as a number of things, which belongs to `of`. @throws InputError
std::size_t take_vtk_count(VtkCursor& cursor, std::string_view of);

/// The next word as a type of numbers. @throws InputError
const VtkType& take_vtk_type(VtkCursor& cursor, std::string_view of);

/// Goes to the numbers of a block, `count` times `each`, where each ≥ 1.
/// @throws InputError, before anything is allocated, if what is left of the file cannot hold so many
void begin_vtk_numbers(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count,
                       std::size_t each);

/// The word of number `taken` (from 0) of `count`, in a text file. @throws InputError at the end
std::string_view take_vtk_number(VtkCursor& cursor, const VtkBlock& block, std::size_t count, std::size_t taken);

/// Goes past the strings of the array `name`, `count` times `each`. In text each is a line; in bytes the two highest
/// bits of its first byte, 3, 2, 1 or 0, say that 1, 2, 4 or 8 bytes have its length in their other bits.
/// @throws InputError
void skip_vtk_strings(VtkCursor& cursor, std::string_view name, std::size_t count, std::size_t each);

/// A whole block. @throws InputError
std::vector<VtkId> take_vtk_ids(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count);

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

}  // namespace pulson::formats
