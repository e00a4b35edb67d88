#include <cmath>

#include "pulson/cohort/prediction.hpp"

namespace pulson::cohort {
namespace {

// The continued fraction of the incomplete beta function by Lentz's method (W. Press et al., Numerical Recipes, 2007,
// 6.4).
double beta_fraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300, kLastFactor = 1e-15;
  constexpr int kMostTerms = 10000;
  const auto nonzero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double c = 1, d = 1 / nonzero(1 - (a + b) * x / (a + 1)), result = d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / nonzero(1 + even * d);
    c = nonzero(1 + even / c);
    result *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / nonzero(1 + odd * d);
    c = nonzero(1 + odd / c);
    result *= d * c;
    if (std::abs(d * c - 1) < kLastFactor) break;
  }
  return result;
}

// I_x(a, b)
double incomplete_beta(double a, double b, double x) {
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1) / (a + b + 2) ? front * beta_fraction(a, b, x) / a : 1 - front * beta_fraction(b, a, 1 - x) / b;
}

// P(T > t), t > 0
double student_tail(double t, double degrees) {
  return 0.5 * incomplete_beta(degrees / 2, 0.5, degrees / (degrees + t * t));
}

}  // namespace

double student_quantile(double p, double degrees) {
  double low = 0, high = 1;
  while (student_tail(high, degrees) > 1 - p) high *= 2;
  for (int i = 0; i < 100 && high - low > 1e-13 * high; ++i) {
    const double middle = (low + high) / 2;
    (middle > 0 && student_tail(middle, degrees) < 1 - p ? high : low) = middle;
  }
  return (low + high) / 2;
}

}  // namespace pulson::cohort
