#pragma once

namespace pulson {

/// A number with its standard error; NaN if there is none, as for a mean of one.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

}  // namespace pulson
