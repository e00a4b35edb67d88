#pragma once

// What the programs that draw for us, gnuplot and ffmpeg, have in common: how they run and what they must leave.

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "core/atomic_file.hpp"

namespace pulson {
class TemporaryFile;
}  // namespace pulson

namespace pulson::draw {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// An unnamed temporary file: it feeds or catches a child's stream without the deadlock that two pipes invite.
/// `program` is named in the message. @throws InputError
File make_scratch_file(std::string_view program);

/// Whether the program is in one of the folders of PATH.
bool is_on_path(std::string_view program);

/// A program that runs beside us. What it prints is kept in a scratch file.
class ChildProcess {
 public:
  /// Starts `arguments`, the program's name first, with the file descriptor `input` as its standard input.
  /// @throws InputError, `not_found` where there is no such program
  ChildProcess(std::vector<std::string> arguments, int input, std::string not_found);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it has not been waited for.
  ~ChildProcess();

  /// Waits until it ends; whether it succeeded. To be called once. @throws InputError if it did not run at all
  bool wait();

  /// All that it printed.
  std::string printed() const;

 private:
  std::string program_;
  std::string not_found_;
  File printed_;
  pid_t child_ = 0;  // 0 once it was waited for
};

/// @throws InputError if `program` left the file empty, or a picture without its end
void require_written(std::string_view program, const TemporaryFile& file);

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

}  // namespace pulson::draw
