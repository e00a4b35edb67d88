#pragma once

#include <string>

namespace pulson {

/// Of a clock that is never set.
double seconds_now();

/// A line of progress on a terminal, rewritten in place; nothing in a pipe, nothing in the first second, nothing where
/// --quiet is given. It goes away at the end, and where Ctrl-C ends the program.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Where nobody knows how much is left. With --verbose the line is kept, on a terminal or not.
  void show(const std::string& text);
  /// A bar, the percentage and the time left, where the part that is done is known, from 0 to 1. A part that is less
  /// than the last one starts anew.
  void show(double fraction, const std::string& text);
  /// Takes the line away, so that something else can be printed.
  void clear();

 private:
  bool is_time_to_draw();
  void draw(const std::string& text);
  /// Seconds left, smoothed.
  double left(double fraction);

  double started_;
  double shown_ = 0;     ///< when; 0 where there is no line now
  double begun_;         ///< of the work that the fractions are of
  double fraction_ = 2;  ///< the last one; more than all, so that the first begins
  double first_ = 0;     ///< the one at `begun_`: work that was done before
  double left_ = -1;     ///< seconds, as last estimated; negative: not yet
  double estimated_ = 0;
  bool on_terminal_;
};

/// "45 s", "3 min", "1.5 h"
std::string duration_text(double seconds);

}  // namespace pulson
