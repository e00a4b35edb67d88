#pragma once

#include <optional>

#include "arguments.hpp"
#include "picture_files.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The coordinates of the image that is warped and of the result, and the result's size.
struct WarpFrames {
  PixelFrame input;
  PixelFrame result;
  int width = 0;
  int height = 0;
  std::optional<Picture> like;
  std::vector<int> label_ranks;  ///< of each landmark: its group's number, or where there is one group its own
};

/// Sizes and coordinates as asked for; else those of the image. y points up where the landmarks are of a tps file.
/// @throws InputError
WarpFrames warp_frames(const WarpArguments& arguments, const Registration& registration, const Picture& input);

}  // namespace pulson
