#pragma once

#include <string>

#include "pulson/io/landmark_files.hpp"

namespace pulson {

/// How `pulson info FILE` reads a file and describes it.
struct FileInfoOptions {
  bool all = false;
  std::string json;
  ReadOptions reading;
};

/// What the file, or one shape of it, holds: first of all shapes, then a line for each. @throws InputError
void print_file_info(const std::string& address, const FileInfoOptions& options);

}  // namespace pulson
