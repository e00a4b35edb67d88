#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

namespace pulson {

/// The state of 1, 2 or 3 numbers, (f, f', …) per power of c/α, whose first component is a process on a line with the
/// covariance of a peakon, Matérn 3/2 or Matérn 5/2 kernel of weight 1. Distances h are in α/c.
template <int S>
using LineState = Eigen::Matrix<double, S, 1>;
template <int S>
using LineMatrix = Eigen::Matrix<double, S, S>;

/// Σ_k (hN)^k/k!, N nilpotent, by rows: times e^{−h} what a state decays to by itself over a distance h.
/// @tparam T a number, or an array of them
template <int S, class T>
std::array<std::array<T, S>, S> line_transition(const T& h) {
  if constexpr (S == 1) {
    return {{{0 * h + 1}}};
  } else if constexpr (S == 2) {
    return {{{1 + h, h}, {-h, 1 - h}}};
  } else {
    const T squared = h * h, half = squared / 2;
    return {{{1 + h + half, h + squared, half},
             {-half, 1 + h - squared, h - half},
             {half - h, squared - 3 * h, 1 - 2 * h + half}}};
  }
}

template <int S>
LineMatrix<S> line_propagator(double h, double decay) {
  const auto rows = line_transition<S>(h);
  LineMatrix<S> propagator;
  for (std::size_t r = 0; r < S; ++r)
    for (std::size_t c = 0; c < S; ++c)
      propagator(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = decay * rows[r][c];
  return propagator;
}

/// States of several steps at once, each over a distance of its own.
inline constexpr int kLineLanes = 8;
using LineLanes = Eigen::Array<double, kLineLanes, 1>;
template <int S>
using LineLaneStates = std::array<LineLanes, S>;

template <int S>
void propagate(LineLaneStates<S>& state, const LineLanes& h, const LineLanes& decay) {
  const auto rows = line_transition<S>(h);
  const LineLaneStates<S> before = state;
  for (std::size_t r = 0; r < S; ++r) {
    state[r] = rows[r][0] * before[0];
    for (std::size_t c = 1; c < S; ++c) state[r] += rows[r][c] * before[c];
    state[r] *= decay;
  }
}

/// By the transposes.
template <int S>
void propagate_back(LineLaneStates<S>& state, const LineLanes& h, const LineLanes& decay) {
  const auto rows = line_transition<S>(h);
  const LineLaneStates<S> before = state;
  for (std::size_t c = 0; c < S; ++c) {
    state[c] = rows[0][c] * before[0];
    for (std::size_t r = 1; r < S; ++r) state[c] += rows[r][c] * before[r];
    state[c] *= decay;
  }
}

/// The covariance of the state at rest, of weight 1.
template <int S>
LineMatrix<S> line_stationary();
template <>
inline LineMatrix<1> line_stationary<1>() {
  return LineMatrix<1>(1);
}
template <>
inline LineMatrix<2> line_stationary<2>() {
  return LineMatrix<2>::Identity();
}
template <>
inline LineMatrix<3> line_stationary<3>() {
  return (LineMatrix<3>() << 1, 0, -1.0 / 3, 0, 1.0 / 3, 0, -1.0 / 3, 0, 1).finished();
}

/// I_n = ∫₀ʰ sⁿ e^{−2s} ds, n = 0 … 4: the last by a series of positive terms, the others by partial integration, whose
/// terms are positive, too. Beyond h = 2 from the first on, where little is subtracted.
inline std::array<double, 5> line_integrals(double h) {
  const double decay = std::exp(-2 * h);
  std::array<double, 5> all{};
  if (h > 2) {
    all[0] = -0.5 * std::expm1(-2 * h);
    double power = 1;
    for (std::size_t n = 1; n < all.size(); ++n) {
      power *= h;
      all[n] = 0.5 * (static_cast<double>(n) * all[n - 1] - power * decay);
    }
    return all;
  }
  double term = std::pow(h, 5) / 5, sum = term;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= 2 * h / (5 + k);
    sum += term;
  }
  all[4] = decay * sum;
  double power = h * h * h * h;
  for (std::size_t n = 4; n-- > 0; power /= h) {
    all[n] = h > 0 ? (2 * all[n + 1] + power * decay) / static_cast<double>(n + 1) : 0;
  }
  return all;
}

/// The covariance that driving noise adds over a distance h, q ∫₀ʰ g(s)g(s)ᵀ ds, g the state that an impulse leaves.
template <int S>
LineMatrix<S> line_driven(double h);
template <>
inline LineMatrix<1> line_driven<1>(double h) {
  return LineMatrix<1>(-std::expm1(-2 * h));
}
template <>
inline LineMatrix<2> line_driven<2>(double h) {  // g = e^{−s}(s, 1 − s)
  const auto i = line_integrals(h);
  const double cross = i[1] - i[2];
  return 4 * (LineMatrix<2>() << i[2], cross, cross, i[0] - 2 * i[1] + i[2]).finished();
}
template <>
inline LineMatrix<3> line_driven<3>(double h) {  // g = e^{−s}(s²/2, s − s²/2, 1 − 2s + s²/2)
  const auto i = line_integrals(h);
  LineMatrix<3> q;
  q(0, 0) = i[4] / 4;
  q(0, 1) = i[3] / 2 - i[4] / 4;
  q(0, 2) = i[2] / 2 - i[3] + i[4] / 4;
  q(1, 1) = i[2] - i[3] + i[4] / 4;
  q(1, 2) = i[1] - 2.5 * i[2] + 1.5 * i[3] - i[4] / 4;
  q(2, 2) = i[0] - 4 * i[1] + 5 * i[2] - 2 * i[3] + i[4] / 4;
  q(1, 0) = q(0, 1);
  q(2, 0) = q(0, 2);
  q(2, 1) = q(1, 2);
  return 16.0 / 3 * q;
}

}  // namespace pulson
