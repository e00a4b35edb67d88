#pragma once

#include "pulson/matching/registration.hpp"

namespace pulson {

/// Options in the shapes' own units, without alignment: for tests of shapes that lie where they should.
inline matching::RegistrationOptions plain_options() {
  matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=auto";
  options.sigma = 0.01;
  options.lambda = 1;
  options.align = AlignmentKind::kNone;
  return options;
}

}  // namespace pulson
