#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "placed_picture.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The coordinates of the image that is warped and of the result, and the result's size.
struct WarpFrames {
  Frame input;
  Frame result;
  int width = 0;
  int height = 0;
  std::optional<Picture> like;
  std::optional<int> orientation;  ///< of the result's pixels, as EXIF and TIFF number it; none: that of the image
  std::array<int, 2> first_pixel{0, 0};  ///< of the result, in pixels of the image that the target was placed on
  std::string title;                     ///< of drawings: source → target
  Points landmarks_there;                ///< of the shape whose image the result is like, in its pixels
  std::vector<std::string> names;        ///< of the landmarks, as drawings show them
  std::vector<int> label_ranks;          ///< of each landmark: its group's number, or where there is one group its own
  std::vector<std::string> notes;
  std::vector<std::string> warnings;
};

/// Sizes and coordinates as asked for, else as the files say. Without --like and --size the result has the frame of the
/// image, grown so that it holds the landmarks of the target and the corners of the warped image, to half a pixel.
/// @param picture that is warped; turned as the landmarks were placed on it
/// @throws InputError as place_picture; where the result would hold none of the target's landmarks
WarpFrames warp_frames(const WarpArguments& arguments, const matching::Registration& registration,
                       const warp::MaterialFlow& flow, Picture& picture);

}  // namespace pulson
