#pragma once

#include <memory>

#include "pulson/core/landmarks.hpp"
#include "pulson/dynamics/noise_model.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// H(q,p) = ½ Σ_ab p_a·p_b K(q_a − q_b), (12).
double hamiltonian(const KernelOperator& kernel, const PhaseState& state);

/// H_p = K(q)p, d×N: the velocities of the landmarks.
Points hamiltonian_p(const KernelOperator& kernel, const Points& q, const Points& p);

/// H_q, column a = Σ_b p_a·p_b ∇K(q_a − q_b), d×N.
Points hamiltonian_q(const KernelOperator& kernel, const Points& q, const Points& p);

/// κ = Δt Lip(K) max_{a≠b} (|p_a − p_b| + 2 Σ_{c≠a,b} |p_c|): the implicit step q⁺ = c + Δt K(q⁺)p is a contraction in
/// the gaps between landmarks where κ < 1, so it has one root, which keeps the order of landmarks on a line. For two
/// landmarks this is Δt |p₁ − p₂| Lip(K). Nothing follows from κ ≥ 1: the bound is far from sharp for many landmarks.
/// O(N²) without exponentials.
double contraction_bound(const KernelOperator& kernel, const Points& p, double dt);

/// The stochastic Hamiltonian system (11): H of a kernel, and the potentials of a noise model.
struct StochasticSystem {
  KernelOperator kernel;
  std::shared_ptr<const NoiseModel> noise;
};

}  // namespace pulson
