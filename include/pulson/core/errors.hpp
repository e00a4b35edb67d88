#pragma once

#include <stdexcept>

namespace pulson {

/// The input or an option is wrong. The message is one line that names the file, line, field or option, the value found
/// and what is expected; the program prints it and exits with code 2, having written nothing.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace pulson
