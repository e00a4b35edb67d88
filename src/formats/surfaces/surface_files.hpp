#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// A surface in space.
struct Surface {
  Landmarks vertices;  ///< 3×V; axes where the file has `SPACE=LPS` or `SPACE=RAS`, as of 3D Slicer
  std::vector<std::array<int, 3>> triangles;  ///< indices of vertices, from 0; polygons are cut into fans
};

/// The surface of a ply (text or binary of either order of bytes), stl (text or binary) or obj file, by its extension.
/// Whatever else these hold, such as colours, is left out.
///
/// @throws InputError if it cannot be read, ends early, has no triangle, a vertex that is not finite or a triangle of
/// vertices that are not there
Surface read_surface(const std::filesystem::path& file);

/// The same where `text` is all that the file holds. Its extension is one of those above.
Surface surface_of_text(const std::filesystem::path& file, std::string_view text);

/// The surface with at most about `most` vertices: those in one cell of a grid of cubes are moved to their mean, and
/// triangles that have then fewer than three corners are left out. The same surface where it has no more vertices.
Surface coarsened(const Surface& surface, int most);

// The formats; `text` is the whole file, and what they return is not checked.
Surface read_ply(const std::string& path, std::string_view text);
Surface read_stl(const std::string& path, std::string_view text);
Surface read_obj(const std::string& path, std::string_view text);

/// `LPS` or `RAS` where the head of a file has `SPACE=LPS` or `SPACE=RAS`; else nothing.
std::string stated_axes(std::string_view text);

/// Three numbers behind the first of the words of a line. @throws InputError
std::array<double, 3> numbers_behind_word(const std::string& path, const text::TextLine& line,
                                          const std::vector<std::string_view>& words);

/// Bytes of a binary stl file: before its count of triangles, and of each of these.
inline constexpr std::size_t kStlHead = 80, kStlTriangle = 50;

/// The number of triangles of a binary stl file, which may begin with "solid" as text does; none where it is text.
std::optional<std::size_t> binary_stl_triangles(std::string_view text);

/// The corners of triangles in their order: those at the same position are one vertex.
class SharedCorners {
 public:
  void add(const std::array<double, 3>& place);

  /// The vertex of each corner, and all vertices.
  const std::vector<int>& corners() const { return corners_; }
  Points vertices() const;

  Surface surface() const;

 private:
  std::map<std::array<double, 3>, int> numbers_;
  std::vector<double> coordinates_;
  std::vector<int> corners_;
};

/// Adds the triangles of a polygon: a fan from its first corner.
void add_polygon(Surface& surface, const std::vector<int>& corners);

}  // namespace pulson::formats
