#pragma once

// What ReadOptions ask of shapes, and notes on what a file holds and is not used without them.

#include <filesystem>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::io {

/// All shapes of a file, before apply_to_shapes.
LandmarkFile read_all_shapes(const std::filesystem::path& path, const ReadOptions& options);

/// Applies scales, chooses landmarks and adds points of curves, in this order, in the shapes that are wanted.
/// @throws InputError that begins with a shape's `source`
void apply_to_shapes(const ReadOptions& options, LandmarkFile& file);

/// Makes curves and outlines that were read as landmarks curves again where they are to be resampled, and withdraws the
/// notes on what the options use. `path` is what the notes call the file.
void prepare_shapes(const ReadOptions& options, const std::string& path, LandmarkFile& file);

/// That scales are not applied; empty where no shape has one.
std::string note_of_scales(const std::vector<Landmarks>& shapes);

/// That curves and outlines are not used; empty where there are none.
std::string note_of_curves(const std::vector<Landmarks>& shapes);

}  // namespace pulson::io
