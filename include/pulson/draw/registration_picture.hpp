#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/picture_files.hpp"

namespace pulson {

/// A picture in the plane. Its rows go down in the picture that shows it, whichever way y points there.
struct PlacedImage {
  std::filesystem::path file;  ///< a png
  Eigen::Vector2d low;         ///< corners of the box that it covers, length units
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
  std::string title;                          ///< one line, may be empty
  std::string subtitle;                       ///< one line, may be empty
};

/// How the landmarks of one group are joined in a picture.
enum class OutlineKind { kNone, kOpen, kClosed };

/// Whether points in their order look like a sampled curve, and whether it closes.
///
/// With g the gaps |x_{i+1} − x_i|, m their median and n the median over all points of the distance to the nearest
/// other point: a curve has at least 12 points, max g ≤ 3m (it never jumps) and m ≤ 2n (neighbours in order are
/// neighbours in space, which scattered points are not), and does not cross itself in the plane; it is closed if also
/// |x_1 − x_N| ≤ 3m. Points on a line, d = 1, are not a curve. points: d×N. O(N²).
OutlineKind outline_kind(const Points& points);

/// Draws a registration: source, target, result, the paths of the landmarks and the deformed grid, as a PNG about 1600
/// pixels wide and an SVG of the same layout.
///
/// d = 2: the source with the undeformed grid beside the result with the deformed one; paths are coloured by time.
/// d = 1: position over time, one colour for each landmark. d = 3: the projections xy, xz and yz.
/// Groups that are curves by `outline_kind` are outlined; where their landmarks lie too close for marks, only the line
/// is drawn, and some of the paths. A target that corresponds has the source's groups and outlines, and short lines
/// join it to the result; one that does not has its own, and no such lines. Landmarks that have a missing coordinate in
/// the target are not drawn there: an outline joins their neighbours. Lengths keep one scale on all axes (but for d =
/// 1, where one axis is time). In the plane y points up, or down where `y_down` of a shape says so.
///
/// @throws InputError on a value that is not finite, except for missing coordinates of the target, on sizes that
/// disagree, where a folder does not exist and where gnuplot is missing or fails; neither file is then written. Takes
/// some tenths of a second; safe to call from several threads.
void write_registration_picture(const RegistrationPicture& picture, const PictureFiles& files);

}  // namespace pulson
