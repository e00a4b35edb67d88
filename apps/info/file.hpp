#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// What `pulson info` reports about a shape beyond its contents.
struct ShapeFacts {
  std::size_t missing = 0;                              ///< landmarks that have a missing coordinate
  std::size_t coincident = 0;                           ///< landmarks at the place of an earlier one
  std::optional<std::pair<int, int>> first_coincident;  ///< the first of these and the one before it at its place
  /// The shape or a group of three or more ends where it begins: the last landmark repeats the first. Such are among
  /// the coincident ones.
  bool repeats_end = false;
};

/// In O(N log N).
ShapeFacts shape_facts(const Landmarks& shape);

/// How `pulson info FILE` reads a file and describes it.
struct FileInfoOptions {
  bool all = false;
  std::string json;
  ReadOptions reading;
};

/// What the file, or one shape of it, holds: first of all shapes, then a line for each. @throws InputError
void print_file_info(const std::string& address, const FileInfoOptions& options);

}  // namespace pulson
