#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace pulson {

class TemporaryFile;

/// One run of gnuplot in a child process: a script with its inline data, and the files that it writes. Every file is
/// drawn under a temporary name in its own folder and renamed once gnuplot has succeeded, so that a failure leaves
/// nothing behind and never harms an older file of that name. An object is for one thread; several may run at once.
class Gnuplot {
 public:
  Gnuplot();

  /// Whether there is a gnuplot in the folders of PATH.
  static bool is_installed();

  Gnuplot(const Gnuplot&) = delete;
  Gnuplot& operator=(const Gnuplot&) = delete;
  ~Gnuplot();

  /// Adds commands; the newline is added.
  void command(std::string_view text);

  /// Adds an inline block of data, rows of numbers as gnuplot reads them, and returns its name: `$block3`.
  std::string add_block(std::string_view rows);

  /// Adds `set output` for this file. @throws InputError if it cannot be written there.
  void set_output(const std::filesystem::path& file);

  /// Runs all that was added and puts the files in place. @throws InputError if gnuplot is not installed, if it fails
  /// (with its message) or if a file could not be written.
  void run();

  /// The text as a gnuplot string in single quotes; control characters become spaces, bytes that are not UTF-8 become
  /// '?'.
  static std::string quoted(std::string_view text);

 private:
  std::string script_;
  int blocks_ = 0;
  std::vector<TemporaryFile> outputs_;
};

}  // namespace pulson
