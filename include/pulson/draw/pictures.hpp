#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::draw {

/// The files of a picture, all of one layout; one without a name is not written.
struct PictureFiles {
  std::filesystem::path png{};
  std::filesystem::path svg{};
  std::filesystem::path pdf{};
  std::optional<double>
      width{};      ///< mm, greater than 0; none: 25.4/96 mm for each unit of the layout, 1200 to 1600 of them
  double dpi = 96;  ///< pixels of the png per inch, greater than 0
  /// Gets the bytes of a png for screens as narrow as a phone's, in a layout of its own: 600 pixels wide, the panels
  /// one above the other, without titles. None: it is not drawn.
  std::string* narrow = nullptr;
};

/// All that the picture of some sample paths shows. d = 1, 2 or 3; N landmarks; K ≥ 1 steps; M ≥ 1 paths.
struct PathPicture {
  Landmarks start;                             ///< d×N, where every path starts; its groups are outlined one by one
  std::vector<double> times;                   ///< K+1 times, increasing
  std::vector<std::vector<Points>> positions;  ///< [path][time]: q, d×N
  std::vector<std::vector<Points>> momenta;    ///< [path][time]: p, d×N
  std::string title;                           ///< one line, may be empty
  std::string subtitle;                        ///< one line, may be empty
};

/// Draws sample paths as a PNG 1200 to 1600 pixels wide and an SVG of the same layout, less than 2 MB for up to 2000
/// landmarks.
///
/// d = 1: positions over time above momenta over time, one colour for each landmark. Two or three paths of several
/// landmarks are drawn side by side, to show which curves belong to one path; more are overlaid.
/// d = 2: the first path over the start shape, coloured by time, and beside it the ends of all paths; where there is
/// only one path, the start with its momenta as arrows. d = 3: the projections xy, xz and yz of the first path and of
/// all ends. Lengths keep one scale on all axes; in the plane y points down where `start.frame.y_down` says so. Where d
/// > 1 and N ≤ 4, each component of the momenta over time stands below.
///
/// Where paths are overlaid, the first is drawn in full and the others faintly. Long paths are thinned by `thin_paths`,
/// and many by `simplify_lines`. Of very many paths or landmarks some are drawn; a heading or the legend says how many.
/// Ends many times as far away as most are left out, and the legend says so. Values over time that grow or shrink by
/// more than four decades have a symmetric logarithmic scale, and the heading says so.
///
/// @throws InputError on a value that is not finite or larger than 1e300, on sizes that disagree, where a folder does
/// not exist; no file is then written. Takes a tenth of a second, for millions of values a second or two; safe to call
/// from several threads.
void write_path_picture(const PathPicture& picture, const PictureFiles& files);

/// Pixels in rows from the top: red, green, blue and opacity, 0 to 255 each.
struct Raster {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba{};
  bool empty() const { return rgba.empty(); }
};

/// A picture in the plane. Its rows go down in the picture that shows it, whichever way y points there.
struct PlacedImage {
  Raster pixels;
  Eigen::Vector2d low;  ///< corners of the box that it covers, length units
  Eigen::Vector2d high;
};

/// All that the picture of one registration shows. d = 1, 2 or 3; N landmarks; K steps.
struct RegistrationPicture {
  Landmarks source;  ///< d×N, where the flow starts; its groups are outlined one by one, each in a colour of its own
  bool aligned = false;  ///< whether the source was moved to where the flow starts, as titles say then
  Landmarks target;  ///< d×N, or d×M where it does not correspond; its points may miss coordinates (NaN), but not all
  bool corresponds = true;          ///< whether landmark a of the target is where landmark a of the source should be
  Points result;                    ///< d×N, where the flow took the source
  std::vector<double> times;        ///< K+1 times, increasing
  std::vector<Points> trajectory;   ///< K+1 entries d×N: the landmarks at `times`
  std::vector<Points> grid_before;  ///< d = 2: lines 2×M of the material grid at the start; may be empty
  std::vector<Points> grid_after;   ///< d = 2: the same lines at the end; may be empty
  std::vector<Points> grid_paths;   ///< d = 1: paths 2×M of material points, rows (t, x); may be empty
  std::optional<PlacedImage> image_before{};  ///< d = 2: below the source
  std::optional<PlacedImage> image_after{};   ///< d = 2: below the result
  /// d = 3: a surface below the landmarks, each triangle three columns, from 0, of the vertices; may be empty
  std::vector<std::array<int, 3>> triangles{};
  Points surface_before{};  ///< d = 3: its vertices 3×V, with the source
  Points surface_after{};   ///< d = 3: the same with the result
  /// d = 2: N each, how much of the noise's action and of the flow's energy each landmark has; 0 or more; may be empty
  Eigen::VectorXd action{};
  Eigen::VectorXd energy{};
  std::vector<std::array<int, 3>>
      map_triangles{};         ///< d = 2: of landmarks, shaded by the means of their energy and action
  std::vector<int> doubted{};  ///< landmarks of the result that have a ▲
  std::string title;           ///< one line, may be empty
  std::string subtitle;        ///< one line, may be empty
};

/// How the landmarks of one group are joined in a picture.
enum class OutlineKind { kNone, kOpen, kClosed };

/// Whether points in their order look like a sampled curve, and whether it closes.
///
/// With g the gaps |x_{i+1} − x_i|, m their median and n the median over all points of the distance to the nearest
/// other point: a curve has at least 12 points, max g ≤ 3m (it never jumps) and m ≤ 2n (neighbours in order are
/// neighbours in space, which scattered points are not), turns by more than 60° at no more than a sixth of its points,
/// does not cross itself in the plane, and is not two rings, one after the other (both parts beside the largest gap
/// close by themselves); it is closed if also |x_1 − x_N| ≤ 3m. Points on a line, d = 1, are not a curve. points: d×N.
/// O(N²).
OutlineKind outline_kind(const Points& points);

/// Draws a registration: source, target, result, the paths of the landmarks and the deformed grid, as a PNG about 1600
/// pixels wide and an SVG of the same layout.
///
/// d = 2: the source with the undeformed grid beside the result with the deformed one; paths are coloured by time;
/// energy is mapped over the source, action over the result.
/// d = 1: position over time, one colour for each landmark. d = 3: the projections xy, xz and yz.
/// Groups that are curves by `outline_kind` are outlined; where their landmarks lie too close for marks, only the line
/// is drawn, and some of the paths. A target that corresponds has the source's groups and outlines, and short lines
/// join it to the result; one that does not has its own, and no such lines. Landmarks that have a missing coordinate in
/// the target are not drawn there: an outline joins their neighbours. Lengths keep one scale on all axes (but for d =
/// 1, where one axis is time). In the plane y points up, or down where `y_down` of a shape says so.
///
/// @throws InputError on a value that is not finite, except for missing coordinates of the target, on sizes that
/// disagree, where a folder does not exist; no file is then written. Takes a tenth of a second; safe to call from
/// several threads.
void write_registration_picture(const RegistrationPicture& picture, const PictureFiles& files);

}  // namespace pulson::draw
