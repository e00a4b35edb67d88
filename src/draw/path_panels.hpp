#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "legend.hpp"
#include "pulson/draw/pictures.hpp"
#include "time_panels.hpp"

namespace pulson::picture {

/// Part of a curve or mark that covers others where `count` of them lie on one another.
double opacity(std::size_t count);

/// "12 of 200 paths", or "200 paths" where all are meant.
std::string some_of(std::size_t shown, std::size_t all, std::string_view what);

/// d = 1: positions or momenta over time, in one panel or, where `columns` > 1, in one for each of so many paths.
TimePanels line_panels(const PathPicture& picture, bool momenta, std::size_t columns);

/// d > 1: the components of the momenta over time, each in a panel.
TimePanels component_panels(const PathPicture& picture);

/// The colour of each landmark: on a line by position at the start. In the plane and in space, where time has that
/// palette, few landmarks have the colours of groups.
std::vector<Colour> landmark_colours(const PathPicture& picture);

/// Each landmark in its colour, named by its label or by its number; of many, the scale of colours.
std::vector<LegendEntry> legend_of_landmarks(const PathPicture& picture);

/// The paths but the first whose ends are drawn.
struct Ends {
  std::vector<std::size_t> others;
  std::size_t outside = 0;  // left out for their distance
};

/// As many as `vertices` allow in all. One path that flew off must not shrink all others to a point: an end is left out
/// if its distance from the middle of the start is more than that of the first path ever is, and more than six times
/// the 90 % quantile of all ends.
Ends choose_ends(const PathPicture& picture, std::size_t vertices);

}  // namespace pulson::picture
