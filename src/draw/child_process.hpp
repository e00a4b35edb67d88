#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace pulson::draw {

/// Where the program is in the folders of PATH, as an absolute path; empty where it is in none.
std::filesystem::path find_program(std::string_view name);

/// A program that runs beside us, in a process group of its own, so that Ctrl-C in a terminal does not reach it. What
/// it prints is kept in an unnamed file, which does without the deadlock that two pipes invite.
class ChildProcess {
 public:
  /// Starts the program of that absolute path with the arguments that follow its name, and with the file descriptor
  /// `input` as its standard input. @throws InputError if it cannot be started
  ChildProcess(std::filesystem::path program, std::vector<std::string> arguments, int input);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it has not been waited for.
  ~ChildProcess();

  /// Waits until it ends; whether it succeeded. To be called once. @throws InputError if it is lost
  bool wait();

  /// All that it printed.
  std::string printed() const;

  /// Whether a signal ended it, and which: "it was killed by signal 9"; else empty.
  const std::string& killed_by() const { return killed_by_; }

 private:
  std::string program_;
  std::string killed_by_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> printed_;
  pid_t child_ = 0;  // 0 once it was waited for
};

}  // namespace pulson::draw
