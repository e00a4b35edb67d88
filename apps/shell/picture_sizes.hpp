#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// The image that the file of a shape names, by a path from the folder of that file or by its name alone, where it is
/// there and a regular file.
std::optional<std::filesystem::path> picture_beside(const Landmarks& shape);

/// The size of the picture that the file of a shape names, for its frame, where the file does not say it and the
/// picture is there.
void find_picture_size(Landmarks& shape);

/// Where y points up in some shapes and down in others: the sizes of their pictures, where these are beside the files,
/// so that in_frame_of() can convert them.
void find_picture_sizes(const std::vector<Landmarks*>& shapes);

}  // namespace pulson
