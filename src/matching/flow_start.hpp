#pragma once

#include <vector>

#include "pulson/core/time_grid.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// Landmarks that a flow without noise is to bring near their targets.
struct FlowProblem {
  const KernelOperator& kernel;
  TimeGrid grid;
  double lambda = 1;
  Points source;                            ///< q0, d×N
  Points target;                            ///< y, d×N, finite
  std::vector<Eigen::MatrixXd> precisions;  ///< R_a⁻¹, d×d each; 0 for a coordinate that was not observed
};

/// Where the search for the momenta begins.
struct FlowStart {
  Points momenta;      ///< p0, d×N
  int iterations = 0;  ///< of Gauss–Newton in the velocity fields
};

/// Momenta near the minimum of the problem without its noise, by Gauss–Newton in the velocity fields of all steps:
///
///     ½(λ/T) Σ_k Δt |v_k|²_V + ½ Σ_a |R_a^{-½}(q_a,K − y_a)|²,   q_{k+1} = q_k + Δt v_k(q_{k+1})
///
/// over fields v_k in the space V of the kernel. A change of the fields moves each landmark through the field's own
/// gradient alone, so with F_k = (I − Δt∇v_k(q_{k+1}))⁻¹ and Φ_k = F_{K−1}…F_k, which are d×d for each landmark, a step
/// needs the dN×dN matrix R + (T/λ) Σ_k Δt Φ_k K(q_{k+1}) Φ_kᵀ, and its solution η gives all fields at once: kernels
/// at q_{k+1} with momenta −(T/λ)Φ_kᵀη. K is never inverted, and rough momenta do not spoil the linearisation, as they
/// do in shooting: a few ten iterations suffice where shooting from p0 = 0 needs hundreds. At its minimum the fields
/// satisfy (20), so p_0 is an initial momentum, and the energy differs from that at t = 0 by the time step's error
/// alone.
///
/// The deviations come down in stages, each a quarter of the one before. Cost O(KN² + (dN)³/3) an iteration.
///
/// With `via`, d×N, the search begins at the flow that takes the landmarks there at half of the time, and with the
/// final deviations: it ends in the minimum next to that way.
FlowStart flow_start(const FlowProblem& problem, const Points* via = nullptr);

}  // namespace pulson
