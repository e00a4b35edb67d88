#include "pulson/core/number_checks.hpp"

#include <cmath>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {

void require_finite(std::string_view what, double value) {
  if (!std::isfinite(value)) throw InputError(fmt::format("{} is {}; it must be finite", what, value));
}

void require_positive(std::string_view what, double value) {
  if (!std::isfinite(value) || !(value > 0))
    throw InputError(fmt::format("{} is {}; it must be a finite number greater than 0", what, value));
}

}  // namespace pulson
