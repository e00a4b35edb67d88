#include "probability_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/undefined.hpp"

namespace pulson {

namespace {

// Of a number's first digit: -3 of 0.0045.
int decimal_exponent(double number) { return static_cast<int>(std::floor(std::log10(std::abs(number)))); }

}  // namespace

std::string value_with_error(double value, double error) {
  if (!(error > 0) || !std::isfinite(value + error)) return fmt::format("{:.6g} ± {:.2g}", value, error);
  constexpr double kLeastFixed = 1e-3;  // below it zeros after the point are hard to count
  constexpr int kMostDigits = 17;       // that a double has
  const int last = decimal_exponent(error) - 1;
  if (std::max(std::abs(value), error) >= kLeastFixed)
    return fmt::format("{:.{}f} ± {:.{}f}", value, std::clamp(-last, 0, kMostDigits), error,
                       std::clamp(-last, 0, kMostDigits));
  if (value == 0) return fmt::format("0 ± {:.1e}", error);
  return fmt::format("{:.{}e} ± {:.1e}", value, std::clamp(decimal_exponent(value) - last, 0, kMostDigits), error);
}

std::string probability_text(const Estimate& estimate, std::int64_t trials) {
  if (trials == 0 || !std::isfinite(estimate.value)) return "undetermined";
  const double unseen = unseen_below(static_cast<double>(trials));
  if (estimate.value == 0) return fmt::format("0 (below {:.2g} with 95 % confidence)", unseen);
  if (estimate.value == 1)
    return fmt::format("1 (above {:.{}f} with 95 % confidence)", 1 - unseen, 1 - decimal_exponent(unseen));
  return value_with_error(estimate.value, estimate.standard_error);
}

std::string positive_number_text(double value, double log_deviation, double low, double high) {
  const std::string text = fmt::format("{:.4g}", value);
  if (log_deviation <= 1) return text + fmt::format(" (± {:.0f} %)", 100 * log_deviation);
  const bool has_low = low > 0, has_high = std::isfinite(high);
  if (has_low && has_high) return text + fmt::format(" ({:.3g} to {:.3g})", low, high);
  if (has_high) return text + fmt::format(" (at most {:.3g})", high);
  return text + (has_low ? fmt::format(" (at least {:.3g})", low) : " (undetermined)");
}

std::string positive_number_text(double value, double log_deviation) {
  constexpr double kNinety = 1.644854;  // deviations of a normal law within which 90 % is
  constexpr double kMostFactor = 100;   // to which numbers are searched
  const double factor = std::exp(kNinety * log_deviation);
  if (!(factor <= kMostFactor)) return fmt::format("{:.4g} (undetermined)", value);
  return positive_number_text(value, log_deviation, value / factor, value * factor);
}

}  // namespace pulson
