#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace pulson {

/// Files that are all put into a folder, or none of them: they are written into a folder within it, whose files
/// `commit` moves up. What was not committed is removed: at the end, or, where a process was killed, by the next one
/// that writes into the folder.
class StagedFiles {
 public:
  /// @throws InputError if nothing can be written in `folder`
  explicit StagedFiles(const std::filesystem::path& folder);
  StagedFiles(const StagedFiles&) = delete;
  StagedFiles& operator=(const StagedFiles&) = delete;
  ~StagedFiles();

  /// Writes what will be `folder/name`, as messages call it. @throws InputError if that fails
  void write(const std::string& name, std::string_view contents);

  /// Where others write a file that is not to be kept.
  std::filesystem::path file(const std::string& name) const { return staged_ / name; }

  /// Moves the files up, in the order in which they were written. Where one cannot be moved, those before it become
  /// what they were. A file that is a link in the folder is written through it; a device or pipe is written to before
  /// any file is moved. @throws InputError if that fails
  void commit();

  /// The same of several folders: all of their files, or none. Those of the last one come last.
  static void commit_together(const std::vector<StagedFiles*>& folders);

 private:
  class Moves;

  std::filesystem::path folder_;
  std::filesystem::path staged_;
  std::vector<std::string> names_;
  int descriptor_ = -1;  ///< of `staged_`, with a shared lock while this process lives
};

}  // namespace pulson
