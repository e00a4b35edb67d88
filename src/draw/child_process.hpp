#pragma once

// What the programs that draw for us, gnuplot and ffmpeg, have in common: how they run and what they must leave.

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "core/atomic_file.hpp"

namespace pulson::picture {

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

}  // namespace pulson::picture
