#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "core/paths.hpp"

namespace pulson {

// Options whose values are paths declare what happens to the files, so that one check of all verbs can refuse a result
// that would replace an input or another result. An option of the type FILE, FOLDER or SHAPE that declares nothing is
// an internal error of every run.

/// The files are read. Each returns the option.
CLI::Option* reads_file(CLI::Option* option);
/// Addresses of shapes, `file#3`, or words such as `mean`.
CLI::Option* reads_shape(CLI::Option* option);
/// FILE.csv:COLUMN
CLI::Option* reads_column(CLI::Option* option);
/// The file is written; `-` is standard output.
CLI::Option* writes_file(CLI::Option* option);
/// Files of the folder are written, which the verb adds by RunPaths::writes.
CLI::Option* writes_folder(CLI::Option* option);
/// One positional argument is both: the last of the values may be the output, which the verb adds.
CLI::Option* reads_and_writes(CLI::Option* option);

/// Whether one of these was called.
bool declares_use(const CLI::Option* option);

/// @throws std::logic_error that names an option of paths which declares no use, or of text which has no type
void require_declared_paths(const CLI::App& program);

/// Refuses images in place of landmarks, all together. @throws InputError where there are two or more
void refuse_pictures(const CLI::App& verb);

/// The files that a run reads and those that it writes. What is added later is compared with what was added before.
class RunPaths {
 public:
  /// Of the options of a parsed verb, `--config` included. @throws InputError
  void add_options_of(const CLI::App& verb);
  /// `what` is what messages call it: an option, or "the image of SOURCE". @throws InputError where it is written too
  void reads(const std::filesystem::path& path, const std::string& what);
  /// @throws InputError where it is read, or written twice
  void writes(const std::filesystem::path& path, const std::string& what);

 private:
  struct Entry {
    std::filesystem::path path;
    std::string what;
    std::optional<FileIdentity> identity{};
  };
  std::vector<Entry> inputs_;
  std::vector<Entry> outputs_;
};

/// Those of this run.
RunPaths& run_paths();

/// Forgets all options that declared their use, and the paths of this run.
void forget_path_options();

/// check_output_file() of a result, which is added to run_paths(). @throws InputError
void check_result_file(const std::filesystem::path& path, const std::string& what);

}  // namespace pulson
