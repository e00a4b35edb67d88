#pragma once

#include <algorithm>

namespace pulson::matching {

/// Where f is greatest on [low, high]: the best of a grid, then golden sections about it.
template <class Function>
double maximum_on(double low, double high, int count, const Function& f) {
  constexpr double kGolden = 0.6180339887498949;
  const double step = (high - low) / (count - 1);
  double best = low, value = f(low);
  for (int i = 1; i < count; ++i) {
    const double x = low + i * step;
    if (const double here = f(x); here > value) best = x, value = here;
  }
  double a = std::max(low, best - step), b = std::min(high, best + step);
  double left = b - kGolden * (b - a), right = a + kGolden * (b - a);
  double at_left = f(left), at_right = f(right);
  while (b - a > 1e-4) {
    if (at_left > at_right) {
      b = right, right = left, at_right = at_left;
      left = b - kGolden * (b - a), at_left = f(left);
    } else {
      a = left, left = right, at_left = at_right;
      right = a + kGolden * (b - a), at_right = f(right);
    }
  }
  return (a + b) / 2;
}

}  // namespace pulson::matching
