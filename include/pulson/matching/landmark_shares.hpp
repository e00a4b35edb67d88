#pragma once

#include <optional>

#include "pulson/matching/registration.hpp"

namespace pulson {

/// What each landmark took part in: of its way and of the cost.
struct LandmarkShares {
  /// d×N: the way of the flow alone, from the same momenta without the noise; empty where its steps have no root.
  Points flow;
  /// d×N: what the noise changes at the end, q(T) − q0 − flow; empty with it.
  Points noise;
  Eigen::VectorXd energy;  ///< N, (λ/2) p_a·v_a: the energy is their sum
  /// N, ½ Σ_k |ΔW_k|²/Δt over the channels that move this landmark; empty where a channel moves several, or there is no
  /// action.
  Eigen::VectorXd action;
  Eigen::VectorXd data;  ///< N, the landmark's part of D; empty for curves
};

LandmarkShares landmark_shares(const Registration& registration);

/// The part of all landmarks' ways that the noise does: Σ_a noise_a·(q_a(T) − q_a(0)) / Σ_a |q_a(T) − q_a(0)|²; none
/// without ways.
std::optional<double> noise_part(const Registration& registration, const LandmarkShares& shares);

}  // namespace pulson
