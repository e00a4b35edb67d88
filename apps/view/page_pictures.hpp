#pragma once

#include <cstdint>
#include <string>

#include "warp/picture_files.hpp"

namespace pulson {

/// A picture without its pixels (they are 0), but with its size and orientation, by the header of a jpg alone: a cohort
/// of photographs would take long to decode, and only those that are shown have to be. Other files are read as a whole.
/// @throws InputError as read_picture(); not where what follows the header is broken
Picture outlined_picture(const std::string& path, std::int64_t max_pixels);

/// A picture in a form that browsers show.
struct ShownPicture {
  std::string type;
  std::string bytes;
};

/// The file as it is where it is png or jpg, upright and not too large; else a jpg of what it shows, reduced to some 16
/// megapixels. @throws InputError where it cannot be read
ShownPicture shown_picture(const std::string& path, std::int64_t max_pixels);

/// Keeps a picture that was dropped onto the page in `folder`, under its own name; what is there already is not
/// replaced, but the same picture is not kept twice. @return its name
/// @throws InputError where it is no picture, or another file has that name
std::string keep_picture(const std::string& folder, const std::string& name, const std::string& bytes,
                         std::int64_t max_pixels);

}  // namespace pulson
