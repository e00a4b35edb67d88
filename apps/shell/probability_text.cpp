#include "probability_text.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/undefined.hpp"

namespace pulson {

std::string probability_text(const Estimate& estimate, std::int64_t trials) {
  if (trials == 0 || !std::isfinite(estimate.value)) return "undetermined";
  const double unseen = unseen_below(static_cast<double>(trials));
  if (estimate.value == 0) return fmt::format("0.0000 (below {:.2g} with 95 % confidence)", unseen);
  if (estimate.value == 1) return fmt::format("1.0000 (above {:.6g} with 95 % confidence)", 1 - unseen);
  return fmt::format("{:.4f} ± {:.4f}", estimate.value, estimate.standard_error);
}

}  // namespace pulson
