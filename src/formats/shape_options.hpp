#pragma once

// What ReadOptions ask of shapes after their file is read.

#include <filesystem>

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

}  // namespace pulson::io
