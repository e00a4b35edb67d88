#pragma once

#include <memory>

#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

/// The Hamiltonian of metamorphosis. Where the energy λ∫H dt is paid for along the whole path and the noise is a
/// control u at the cost ½∫Σ u_i² dt, Pontryagin's principle gives u_i = λ h_i(q, p) for potentials that are linear in
/// p, and the best paths are the flow of
///
///     H_tot(q, p) = H(q, p) + (λ/2) Σ_i h_i(q, p)²,
///
/// which is (11) with the noise u. Without noise H_tot = H. (design: mathematics §4.1)
class EffectiveHamiltonian {
 public:
  /// @param lambda λ, the weight of the energy against controls
  EffectiveHamiltonian(StochasticSystem system, double lambda);

  const StochasticSystem& system() const { return system_; }
  double lambda() const { return lambda_; }

  double value(const PhaseState& state) const;

  /// u = λ h(q, p), C numbers: increments per time.
  Eigen::VectorXd controls(const PhaseState& state) const;

  /// ∂H_tot/∂p, d×N: velocities.
  Points velocity(const PhaseState& state) const;

  /// ∂H_tot/∂q, d×N: what the momenta lose per time.
  Points force(const PhaseState& state) const;

  /// Both, from one pass over the pairs.
  Flow flow(const PhaseState& state) const;

  /// Their change along a change of the state.
  Flow flow_change(const PhaseState& state, const PhaseState& change) const;

  /// The change of the velocity along a change δq, d×N, of the positions only.
  Points velocity_change(const PhaseState& state, const Points& dq) const;

  /// The change of the force along a change of the state.
  Points force_change(const PhaseState& state, const PhaseState& change) const;

  /// The part of the noise in these changes: of the force (q) and the velocity (p). Where it is additive a change of
  /// the positions makes none.
  PhaseState noise_change(const PhaseState& state, const PhaseState& change) const;

 private:
  StochasticSystem system_;
  double lambda_;
  bool noisy_;
};

/// (λ/2) Σ_i h_i(q, p)² as a part of the Hamiltonian: a model that has no channels and G = (λ/2) Σ h_i², so that
/// `variational`, which evaluates H + G at (q⁺, p), takes the steps of (20) for H_tot.
std::shared_ptr<const NoiseModel> control_energy(std::shared_ptr<const NoiseModel> noise, double lambda);

}  // namespace pulson
