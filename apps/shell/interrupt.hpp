#pragma once

#include <string>

namespace pulson {

/// While there is one, Ctrl-C and the signal to terminate are noted and not obeyed at once, so that work can be put in
/// order. A second signal ends the program.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  static bool came();
};

/// While there is one, Ctrl-C and the signal to terminate print a line on standard error that says what is lost, before
/// they end the program. One at a time.
class LossNotice {
 public:
  /// @param loss as in "interrupted: the search is lost"
  explicit LossNotice(const std::string& loss);
  ~LossNotice();
  LossNotice(const LossNotice&) = delete;
  LossNotice& operator=(const LossNotice&) = delete;
};

}  // namespace pulson
