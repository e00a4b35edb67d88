#pragma once

#include <cstdlib>
#include <string>

#include <sys/wait.h>

#include "program.hpp"

namespace pulson {

/// Runs lines of bash, in which `$P` is the program: what only a shell makes, such as closed descriptors.
class ShellCommands : public Program {
 protected:
  /// The exit code is that of the last command; 124 where it took more than a minute.
  static ProgramRun bash(const std::string& lines) {
    write("captured_lines", "P='" PULSON_PROGRAM "'\n" + lines + "\n");
    const int status = std::system("timeout -s KILL 60 bash captured_lines > captured_out 2> captured_err");
    ProgramRun result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents("captured_out"), contents("captured_err")};
    for (const char* name : {"captured_lines", "captured_out", "captured_err"}) std::filesystem::remove(name);
    return result;
  }
};

}  // namespace pulson
