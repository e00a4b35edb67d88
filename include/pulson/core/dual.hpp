#pragma once

#include <cmath>

#include <Eigen/Core>

namespace pulson {

/// value + change·ε with ε² = 0: a function written for any scalar, called with Duals, gives its exact derivative along
/// the direction in the arguments' changes.
struct Dual {
  double value = 0;
  double change = 0;

  constexpr Dual() = default;
  constexpr Dual(double v) : value(v) {}  // NOLINT(google-explicit-constructor): numbers are Duals at rest
  constexpr Dual(double v, double c) : value(v), change(c) {}

  constexpr Dual& operator+=(const Dual& b) { return *this = {value + b.value, change + b.change}; }
  constexpr Dual& operator-=(const Dual& b) { return *this = {value - b.value, change - b.change}; }
  constexpr Dual& operator*=(const Dual& b) { return *this = {value * b.value, change * b.value + value * b.change}; }
  constexpr Dual& operator/=(const Dual& b) {
    const double quotient = value / b.value;
    return *this = {quotient, (change - quotient * b.change) / b.value};
  }
};

constexpr Dual operator-(const Dual& a) { return {-a.value, -a.change}; }
constexpr Dual operator+(Dual a, const Dual& b) { return a += b; }
constexpr Dual operator-(Dual a, const Dual& b) { return a -= b; }
constexpr Dual operator*(Dual a, const Dual& b) { return a *= b; }
constexpr Dual operator/(Dual a, const Dual& b) { return a /= b; }

constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value && a.change == b.change; }

inline Dual exp(const Dual& a) { return {std::exp(a.value), std::exp(a.value) * a.change}; }
inline Dual sin(const Dual& a) { return {std::sin(a.value), std::cos(a.value) * a.change}; }
inline Dual cos(const Dual& a) { return {std::cos(a.value), -std::sin(a.value) * a.change}; }

}  // namespace pulson

/// @cond
/// So that Eigen's matrices may hold Duals.
template <>
struct Eigen::NumTraits<pulson::Dual> : Eigen::NumTraits<double> {
  using Real = pulson::Dual;
  using NonInteger = pulson::Dual;
  using Nested = pulson::Dual;
  // Eigen's names. NOLINTBEGIN(readability-identifier-naming)
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 2,
    MulCost = 4
  };
  // NOLINTEND(readability-identifier-naming)
};
/// @endcond
