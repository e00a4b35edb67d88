#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "messages.hpp"

namespace pulson {

/// `-o`, `--json`, `--no-picture` and `--quiet` of verbs that write their results into a folder.
struct OutputOptions {
  std::string out;
  std::string json;
  bool no_picture = false;

  /// `pictures` is what help calls them: `paths.png and .svg`. Verbs with an option --q have no -q for quiet.
  void add_to(CLI::App& verb, const std::string& pictures, const std::string& quiet_names = "--quiet");

  std::filesystem::path file(const std::string& name) const { return std::filesystem::path(out) / name; }
  /// Whether the summary is to be printed.
  bool prints() const { return json != "-" && verbosity() != Verbosity::kQuiet; }

  /// All that can be known to fail before the work is done. @throws InputError
  void check(const std::vector<std::string>& files, const std::vector<std::string>& pictures) const;
  /// Writes the record to --json, where that was asked for.
  void write_json(const std::string& record) const;
  /// "wrote      DIR: a, b, c"
  void print_written(std::vector<std::string> files, const std::vector<std::string>& pictures) const;
};

}  // namespace pulson
