#pragma once

// What ReadOptions ask of shapes, notes on what a file holds and is not used without them, and curves and outlines as
// landmarks and sampled.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Makes the points of curves and outlines the landmarks of a shape that has no others, a group for each: `curve 1`.
/// @return whether there were such
bool take_lines_as_landmarks(Landmarks& shape);

/// Undoes it: makes landmarks that are all in groups `curve 1`, `outline 1` and so on curves and outlines again.
/// @return whether they are
bool give_lines_back(Landmarks& shape);

/// The note where that was done.
std::string taken_as_landmarks(std::size_t shapes);

/// The polygon through the points of `line`, from the first to the last or, where it is closed, back to the first.
enum class LineEnds { kOpen, kClosed };

/// `count` points at equal distances of arc length: of an open line with both ends, of a closed one from its first
/// point on. Points that have a missing coordinate are left out. Costs O(line + count).
/// @return NaN where the line has no points
/// @throws InputError where it has no length, or one beyond the largest number
Points evenly_spaced(const Points& line, LineEnds ends, int count);

/// All shapes of a file, before apply_to_shapes.
LandmarkFile read_all_shapes(const std::filesystem::path& path, const ReadOptions& options);

/// Gives all shapes the links that the table at `path` lists, see ReadOptions::links. Notes rows with landmarks that a
/// shape lacks. @throws InputError that names file and line, also where no shape has a landmark of the table
void apply_links(const std::string& path, LandmarkFile& file);

/// Applies scales and links, chooses landmarks and adds points of curves, in this order, in the shapes that are wanted.
/// @throws InputError that begins with a shape's `source`
void apply_to_shapes(const ReadOptions& options, LandmarkFile& file);

/// Makes curves and outlines that were read as landmarks curves again where they are to be resampled, and withdraws the
/// notes on what the options use. `path` is what the notes call the file.
void prepare_shapes(const ReadOptions& options, const std::string& path, LandmarkFile& file);

/// That scales are not applied; empty where no shape has one.
std::string note_of_scales(const std::vector<Landmarks>& shapes);

/// That curves and outlines are not used; empty where there are none.
std::string note_of_curves(const std::vector<Landmarks>& shapes);

}  // namespace pulson::formats
