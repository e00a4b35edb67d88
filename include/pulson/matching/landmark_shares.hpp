#pragma once

#include <optional>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// The contribution of flow and noise to each landmark's displacement, and its share of the cost.
struct LandmarkShares {
  /// d×N: displacement by the flow of the same momenta without noise; empty where its steps have no root.
  Points flow;
  /// d×N: displacement by the noise, q(T) − q0 − flow; empty where `flow` is.
  Points noise;
  Eigen::VectorXd energy;  ///< N, (λ/2) p_a·v_a: the energy is their sum
  /// N, ½ Σ_k |ΔW_k|²/Δt over the channels that move this landmark; empty where a channel moves several, or there is no
  /// action.
  Eigen::VectorXd action;
  Eigen::VectorXd data;  ///< N, the landmark's share of D; empty for curves
};

LandmarkShares landmark_shares(const Registration& registration);

/// The fraction of the displacement due to the noise: Σ_a noise_a·(q_a(T) − q_a(0)) / Σ_a |q_a(T) − q_a(0)|²; none if
/// nothing moves.
std::optional<double> noise_fraction(const Registration& registration, const LandmarkShares& shares);

}  // namespace pulson::matching
