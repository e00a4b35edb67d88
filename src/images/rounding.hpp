#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace pulson::images {

/// In which means of numbers are computed: float32 holds their products with weights to well below one half where they
/// have up to 16 bits.
template <class Value>
using Sum = std::conditional_t<sizeof(Value) <= 2 || std::is_same_v<Value, float>, float, double>;

/// The nearest number of the type, whole ones at most `full`; 0 for what is no number.
template <class Value, class Number>
Value rounded(Number number, double full) {
  if constexpr (std::is_floating_point_v<Value>) {
    return static_cast<Value>(number);
  } else {
    using Limits = std::numeric_limits<Value>;
    constexpr auto kLowest = static_cast<Number>(Limits::lowest());
    if (!(number > kLowest)) return number <= kLowest ? Limits::lowest() : Value{0};
    if (number >= static_cast<Number>(full))
      return full >= static_cast<double>(Limits::max()) ? Limits::max() : static_cast<Value>(full);
    if constexpr (sizeof(Value) <= 2)
      return static_cast<Value>(static_cast<int>(number + (number < 0 ? Number(-0.5) : Number(0.5))));
    else
      return static_cast<Value>(std::round(number));
  }
}

}  // namespace pulson::images
