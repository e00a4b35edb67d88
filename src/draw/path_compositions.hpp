#pragma once

#include "canvas.hpp"
#include "pulson/draw/path_picture.hpp"

namespace pulson::picture {

/// The whole drawing for each dimension. The picture has been checked.
Canvas compose_paths_on_line(const PathPicture& picture);   // d = 1
Canvas compose_paths_in_plane(const PathPicture& picture);  // d = 2
Canvas compose_paths_in_space(const PathPicture& picture);  // d = 3

}  // namespace pulson::picture
