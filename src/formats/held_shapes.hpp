#pragma once

#include <filesystem>
#include <string>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Shapes in memory that readers find under a name as if it were a file's, while this lives: arrays of a program that
/// runs verbs itself. For one thread at a time, and the threads that it starts and waits for.
class HeldShapes {
 public:
  /// @param file as a reader gives it, before options of reading are applied
  HeldShapes(std::string name, LandmarkFile file);
  ~HeldShapes();
  HeldShapes(HeldShapes&& other) noexcept;
  HeldShapes(const HeldShapes&) = delete;
  HeldShapes& operator=(const HeldShapes&) = delete;
  HeldShapes& operator=(HeldShapes&&) = delete;

 private:
  std::string name_;
};

/// Those of that name; null where there are none.
const LandmarkFile* held_shapes(const std::filesystem::path& name);

}  // namespace pulson::formats
