#pragma once

#include <cstddef>
#include <vector>

#include "pulson/draw/path_picture.hpp"

namespace pulson::picture {

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
