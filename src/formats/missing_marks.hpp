#pragma once

// Landmarks that a file has no place for: which numbers stand for them, and which of them the specimen does not have.

#include <string>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Applies the codes of ReadOptions, and notes landmarks that look like such codes and are read as points. `path` is
/// what the notes call the file.
void mark_missing(const ReadOptions& options, const std::string& path, LandmarkFile& file);

/// Marks the landmarks that a table lists as absent, see ReadOptions::absent_table. @throws InputError that names file
/// and line
void apply_absent_table(const std::string& address, LandmarkFile& file);

}  // namespace pulson::formats
