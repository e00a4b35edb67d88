#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Sets what the reader of a file left open: y by the options, else the file, else its format. Where none says it,
/// coordinates are of rows of a picture. @param is_of_image whether a table says that its points are places in one
void complete_frame(const LandmarkFormat& format, bool is_of_image, const ReadOptions& options, Landmarks& shape);

/// Mirrors a shape where the format counts y in the other direction than the shape says; adds to `notes` that it does,
/// or that the shape does not say.
/// @throws InputError where the height of its picture is not known
void put_y_in_direction(const std::string& path, const LandmarkFormat& format, Landmarks& shape,
                        std::vector<std::string>& notes);

}  // namespace pulson::formats
