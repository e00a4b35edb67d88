#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "pulson/core/time_grid.hpp"

namespace pulson {

/// `--time`, `--steps` or `--dt`.
struct TimeOptions {
  double time = 1;
  int steps = 20;
  std::optional<double> dt;

  void add_to(CLI::App& verb);
  /// K equal steps, none longer than --dt where that is given. @throws InputError
  TimeGrid grid() const;
};

/// `--threads`; sets the number at once.
void add_threads_option(CLI::App& verb);

/// A line of progress on a terminal, rewritten in place; nothing in a pipe and nothing in the first second.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void show(const std::string& text);

 private:
  double started_;
  double shown_ = 0;
  bool on_terminal_;
};

}  // namespace pulson
