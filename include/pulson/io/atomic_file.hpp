#pragma once

#include <filesystem>
#include <string_view>

namespace pulson {

/// Writes `contents` to a temporary file in the same folder and renames it to `path`, so that `path` holds either all
/// of them or what it held before. A device or pipe is written to directly. @throws InputError if that fails (no such
/// folder, no permission, full disk); the temporary is removed.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// Makes the folder `path`, and those above it, unless it is there. @throws InputError if that fails, if `path` is
/// something else, or if nothing may be written in it.
void create_output_directory(const std::filesystem::path& path);

}  // namespace pulson
