#pragma once

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

}  // namespace pulson
