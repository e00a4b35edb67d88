#pragma once

#include <vector>

#include "pulson/core/phase_state.hpp"

namespace pulson {

/// How one step moves any point X of space, as it moves landmarks: by stages j = 1..S, each with fields of the
/// landmarks' state then, u_j(x) = Σ_b K(x − q_b) p_b of the flow and η_j of the noise,
///
///     Y_i = X + Σ_{j≤i} (drift(i,j) u_j(Y_j) + noise(i,j) η_j(Y_j)),   i = 1..S + 1,   X⁺ = Y_{S+1}
///
/// Explicit where drift(i,i) = noise(i,i) = 0.
struct SpaceStep {
  std::vector<PhaseState> stages;  ///< (q, p) of the landmarks, S of them
  Eigen::MatrixXd drift;           ///< (S+1)×S, time
  Eigen::MatrixXd noise;           ///< (S+1)×S
  Eigen::VectorXd w;               ///< the increments of η
  bool compensated = false;        ///< whether G_p is part of u
};

}  // namespace pulson
