#pragma once

// A small shape, states and weights by chance, and what is computed with states.

#include <cmath>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/core/landmarks.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

inline constexpr int kCount = 5;  ///< landmarks of each shape

inline Landmarks make_shape(int d, bool grouped = false) {
  Landmarks shape;
  shape.points = random_points(d, kCount, 11);
  if (grouped) shape.groups = {"a", "a", "b", "b", "c"};
  return shape;
}

inline PhaseState random_state(int d, unsigned seed) {
  return {random_points(d, kCount, seed), random_points(d, kCount, seed + 1)};
}

inline Eigen::VectorXd random_vector(Eigen::Index size, unsigned seed) {
  return random_points(1, static_cast<int>(size), seed).row(0);
}

inline PhaseState operator+(const PhaseState& a, const PhaseState& b) { return {a.q + b.q, a.p + b.p}; }
inline PhaseState operator-(const PhaseState& a, const PhaseState& b) { return {a.q - b.q, a.p - b.p}; }
inline PhaseState operator*(double factor, const PhaseState& a) { return {factor * a.q, factor * a.p}; }
inline double dot(const PhaseState& a, const PhaseState& b) {
  return a.q.cwiseProduct(b.q).sum() + a.p.cwiseProduct(b.p).sum();
}
inline double norm(const PhaseState& a) { return std::sqrt(dot(a, a)); }

/// A unit vector of the phase space; positions first.
inline PhaseState unit_state(int d, Eigen::Index m) {
  PhaseState e{Points::Zero(d, kCount), Points::Zero(d, kCount)};
  (m < e.q.size() ? e.q(m) : e.p(m - e.q.size())) = 1;
  return e;
}

inline void expect_close(const PhaseState& found, const PhaseState& right, double tolerance = 1e-12) {
  EXPECT_LE(norm(found - right), tolerance * norm(right));
}

}  // namespace pulson
