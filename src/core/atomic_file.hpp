#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace pulson {

/// @throws InputError "cannot write 'path': reason"
[[noreturn]] void fail_to_write(const std::filesystem::path& path, const std::string& reason);

/// The message of errno.
std::string last_error();

/// @throws InputError unless `path` can be that of a file: its folder is there and it is no folder itself
void require_file_path(const std::filesystem::path& path);

/// A file next to the one that it becomes, so that this holds either all that was written or what it held before. It is
/// removed unless it is put in place.
class TemporaryFile {
 public:
  /// Makes an empty file with a hidden name and the extension of `target`, beside what that is a link to where it is
  /// one, so that the link stays. `named` is what messages call the target. @throws InputError if it cannot be made
  TemporaryFile(const std::filesystem::path& target, std::filesystem::path named);
  TemporaryFile(TemporaryFile&& other) noexcept;
  TemporaryFile& operator=(TemporaryFile&&) = delete;
  ~TemporaryFile();

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& named() const { return named_; }

  /// Renames it to the target. @throws InputError
  void put_in_place();

 private:
  std::filesystem::path target_;
  std::filesystem::path named_;
  std::filesystem::path path_;  // empty once it is in place
};

/// Writes `contents` into the file `to`, which is made where it is missing; messages name `named`. @throws InputError
/// if that fails, also where the disk is full
void write_bytes(const std::filesystem::path& to, std::string_view contents, const std::filesystem::path& named);

/// Writes `contents` to a temporary file in the same folder and renames it to `path`, so that `path` holds either all
/// of them or what it held before. Links are written through, also those to a file that is yet to be made. A device or
/// pipe is written to directly. @throws InputError if that fails (no such
/// folder, no permission, full disk); the temporary is removed.
void write_file_atomically(const std::filesystem::path& path, std::string_view contents);

/// Whether write_file_atomically could write to `path` as far as can be checked without writing: its folder exists and
/// it is not a folder itself. For use before a long computation. @throws InputError if not
void check_output_file(const std::filesystem::path& path);

/// Makes the folder `path`, and those above it, unless it is there. @throws InputError if that fails, if `path` is
/// something else, or if nothing may be written in it.
void create_output_directory(const std::filesystem::path& path);

/// Whether the file at `path` is the one that is open.
bool is_still_at(int descriptor, const std::filesystem::path& path);

/// Keeps other processes from writing their results into the same folder, or one file of it: holds a lock on
/// `folder/.pulson.lock` or `folder/.FILE.lock`, which names the process and is removed at the end. The lock ends with
/// the process, however that ends; where the file system has no locks, none is held.
class FolderLock {
 public:
  /// @throws InputError if another process holds the lock, or if the file cannot be made
  explicit FolderLock(const std::filesystem::path& folder, const std::string& file = "");
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace pulson
