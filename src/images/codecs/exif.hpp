#pragma once

#include <string>
#include <string_view>

namespace pulson::images {

/// The orientation, 1 to 8, that EXIF data say; 1 where they say none. They begin as a TIFF file. Reads nothing beyond.
int exif_orientation(std::string_view exif);

/// The data with this orientation and without a picture in small, which would be of another picture; empty where there
/// is nothing to be said. Data without a place for an orientation are replaced where one is needed.
std::string exif_of(std::string exif, int orientation);

}  // namespace pulson::images
