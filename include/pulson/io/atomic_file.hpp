#pragma once

#include <filesystem>
#include <string_view>

namespace pulson {

/// Writes `contents` to a temporary file in the same folder and renames it to `path`, so that `path` holds either all
/// of them or what it held before. A device or pipe is written to directly. @throws InputError if that fails (no such
/// folder, no permission, full disk); the temporary is removed.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// Whether write_file_atomically could write to `path` as far as can be told without writing: its folder is there and
/// it is no folder itself. For use before a long computation. @throws InputError if not
void check_output_file(const std::filesystem::path& path);

/// Makes the folder `path`, and those above it, unless it is there. @throws InputError if that fails, if `path` is
/// something else, or if nothing may be written in it.
void create_output_directory(const std::filesystem::path& path);

}  // namespace pulson
