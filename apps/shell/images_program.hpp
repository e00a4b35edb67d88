#pragma once

#include <filesystem>

namespace pulson {

/// The program beside this one that runs the verbs that need libraries for image files, which take a tenth of a second
/// to load.
inline std::filesystem::path images_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "pulson-images";
}

}  // namespace pulson
