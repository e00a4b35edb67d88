#pragma once

#include <cstdint>
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

/// A program that runs beside us, in a process group of its own, so that Ctrl-C in a terminal does not reach it.
class ChildProcess {
 public:
  /// Starts the program of that absolute path with the arguments that follow its name. @throws InputError if that fails
  ChildProcess(const std::filesystem::path& program, std::vector<std::string> arguments);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it has not been waited for.
  ~ChildProcess();

  /// Gives it the bytes on its standard input; whether it took them all. errno says why not.
  bool send(const std::vector<std::uint8_t>& bytes) const;

  /// Ends its standard input and waits until it ends; empty where it succeeded, else all that it printed, or which
  /// signal ended it. To be called once. @throws InputError if it is lost
  std::string wait();

 private:
  std::string program_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> printed_;  // unnamed; two pipes would invite a deadlock
  int input_ = -1;
  pid_t child_ = 0;  // 0 once it was waited for
};

}  // namespace pulson::draw
