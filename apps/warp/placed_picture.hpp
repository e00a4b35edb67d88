#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "picture_files.hpp"
#include "pulson/core/frame.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// What options say of the pixels of a picture.
struct FrameOptions {
  std::optional<double> pixel_size;
  std::optional<std::array<double, 2>> origin;
  std::optional<bool> flip_y;

  /// Then landmarks outside the picture are what was asked for.
  bool say_units() const { return pixel_size || origin; }
};

/// A picture as landmarks were placed on it, and where its pixels are in their coordinates.
struct PlacedPicture {
  Picture picture;
  Frame frame;
  std::vector<std::string> notes;
  std::vector<std::string> warnings;
};

/// The pixels of a picture in the coordinates of landmarks that were placed on it: by the options, else by what the
/// landmarks' file says, else by the picture's header; else coordinates are pixels. A reduced or enlarged copy of the
/// picture that the landmarks were placed on is found by its size. A picture that is to be displayed turned is turned
/// where the landmarks were placed on the displayed one: by the size of that where the file says it, else by the
/// program that wrote the file, unless they lie on the picture the other way alone.
/// @param file what messages call the picture
/// @throws InputError where the picture is another one, or where landmarks lie outside it or within a few pixels of it,
/// unless the options say their unit; it names the likeliest option
PlacedPicture place_picture(Picture picture, const std::string& file, const Landmarks& landmarks,
                            const FrameOptions& options);

/// A shape whose coordinates have no picture that says where they lie: its directions and units.
Frame frame_on(const Landmarks& landmarks, const FrameOptions& options, const Frame& otherwise);

}  // namespace pulson
