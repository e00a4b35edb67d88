#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/picture_files.hpp"

namespace pulson {

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
/// all ends. Lengths keep one scale on all axes; in the plane y points down where `start.y_down` says so. Where d > 1
/// and N ≤ 4, each component of the momenta over time stands below.
///
/// Where paths are overlaid, the first is drawn in full and the others faintly. Long paths are thinned by `thin_paths`,
/// and many by `simplify_lines`. Of very many paths or landmarks some are drawn; a heading or the legend says how many.
/// Ends many times as far away as most are left out, and the legend says so. Values over time that grow or shrink by
/// more than four decades have a symmetric logarithmic scale, and the heading says so.
///
/// @throws InputError on a value that is not finite or larger than 1e300, on sizes that disagree, where a folder does
/// not exist and where gnuplot is missing or fails; neither file is then written. Takes some tenths of a second, for
/// millions of values a second or two; safe to call from several threads.
void write_path_picture(const PathPicture& picture, const PictureFiles& files);

}  // namespace pulson
