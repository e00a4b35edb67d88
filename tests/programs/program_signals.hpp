#pragma once

#include <algorithm>
#include <chrono>
#include <csignal>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "program.hpp"

namespace pulson {

/// Programs in the background that get signals.
template <class Base>
class WithSignals : public Base {
 protected:
  using Base::contents;
  using Base::words;
  using typename Base::Arguments;

  static ProgramRun finished(const pid_t child) {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), contents("out.txt"), contents("err.txt")};
  }

  /// A child that computes, and so notes the signals that it gets.
  static pid_t sampling(const std::string& line) {
    const pid_t child = ::fork();
    if (child == 0) become(words(line));
    while (!catches(child, SIGTERM) && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return child;
  }

  static bool is_running(pid_t child) {
    siginfo_t info{};
    return ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
  }

  /// Whether the process has a handler of its own for a signal.
  static bool catches(pid_t child, int signal) {
    std::istringstream stream(contents("/proc/" + std::to_string(child) + "/status"));
    for (std::string line; std::getline(stream, line);)
      if (line.starts_with("SigCgt:")) return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1U) != 0;
    return false;
  }

  /// Processor time that it has used itself.
  static double seconds_used(pid_t child) {
    // The program's name, in parentheses, is the second word of many.
    const std::string text = contents("/proc/" + std::to_string(child) + "/stat");
    const Arguments after_name = words(text.substr(std::min(text.size(), text.rfind(')') + 1)));
    return after_name.size() > 11 ? std::stod(after_name[11]) / static_cast<double>(::sysconf(_SC_CLK_TCK)) : 0;
  }

 private:
  [[noreturn]] static void become(Arguments arguments) {
    const int out = ::open("out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int err = ::open("err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (out < 0 || err < 0 || ::dup2(out, STDOUT_FILENO) < 0 || ::dup2(err, STDERR_FILENO) < 0) ::_exit(126);
    arguments.insert(arguments.begin(), PULSON_PROGRAM);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::alarm(120);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }
};

}  // namespace pulson
