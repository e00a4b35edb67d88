#pragma once

#include <filesystem>
#include <string>

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
  /// Makes an empty file with a hidden name and the extension of `target`. `named` is what messages call the target.
  /// @throws InputError if it cannot be made
  TemporaryFile(std::filesystem::path target, std::filesystem::path named);
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

}  // namespace pulson
