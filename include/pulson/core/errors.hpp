#pragma once

#include <stdexcept>

namespace pulson {

/// What the library throws but for bugs. The message is one line. A setting that would help is named as the options
/// have it, in backticks: `grid.steps`, `data.kind = landmarks`.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What the caller gave is wrong. The message names the file, line, field or option, the value found and what is
/// expected; the program prints it and exits with code 2, having written nothing.
class InputError : public Error {
 public:
  using Error::Error;
};

/// What the caller gave may be right, but the numbers it leads to cannot be computed with: a step has no solution, or
/// the range of numbers is left. Not converging is no error. The message names what failed and, where there is one, the
/// remedy; the program prints it and exits with code 2, having written nothing.
class NumericalError : public Error {
 public:
  using Error::Error;
};

}  // namespace pulson
