#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "core/atomic_file.hpp"
#include "messages.hpp"

namespace pulson {

/// `-o`, `--json`, `--no-picture` and `--quiet` of verbs that write their results into a folder.
struct OutputOptions {
  std::string out;
  std::string json;
  bool no_picture = false;
  mutable std::shared_ptr<FolderLock> lock{};  ///< of the folder, from `check` on

  /// `pictures` is what help calls them: `paths.png and .svg`.
  void add_to(CLI::App& verb, const std::string& pictures);

  std::filesystem::path file(const std::string& name) const { return std::filesystem::path(out) / name; }
  /// Whether the summary is to be printed.
  bool prints() const { return json != "-" && verbosity() != Verbosity::kQuiet; }

  /// All that can be known to fail before the work is done; locks the folder. @throws InputError
  void check(const std::vector<std::string>& files, const std::vector<std::string>& pictures) const;
  /// Writes the record to --json, where that was asked for.
  void write_json(const std::string& record) const;
  /// "wrote      DIR: a, b, c"
  void print_written(std::vector<std::string> files, const std::vector<std::string>& pictures) const;
};

}  // namespace pulson
