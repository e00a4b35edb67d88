#pragma once

#include <string>

#include "pulson/core/phase_state.hpp"

namespace pulson {

/// A noise model of the stochastic Hamiltonian system (11): channels i = 1..C, each a potential h_i(q,p) that drives
/// `dq = … + Σ h_i,p ∘ dW_i`, `dp = … − Σ h_i,q ∘ dW_i`.
///
/// Integrators use a model through increments w (C numbers) and h_w = Σ_i w_i h_i. The models so far have h_q = 0 and
/// h_p constant (`additive position noise`), for which the adapted momentum of the integrator is the momentum itself.
class NoiseModel {
 public:
  virtual ~NoiseModel() = default;

  /// The specification that makes this model again: `ch-sd:beta=1`.
  virtual std::string spec() const = 0;

  /// C, for shapes of `count` landmarks in R^d.
  virtual int channels(int dimension, int count) const = 0;

  /// Whether every flow of this model is a diffeomorphism, so that landmarks cannot pass each other in the limit Δt →
  /// 0.
  virtual bool diffeomorphic() const = 0;

  /// Σ_i h_i,p w_i, d×N. @param increments C numbers
  virtual Points position_noise(const PhaseState& state, const Eigen::VectorXd& increments) const = 0;

  /// The transpose of position_noise in its increments: entry i is Σ_a h_i,p_a · q_bar_a. @param q_bar d×N
  virtual Eigen::VectorXd position_noise_transposed(const PhaseState& state, const Points& q_bar) const = 0;

  /// @throws InputError if the model cannot act on N landmarks in R^d, as where `on=9` meets eight landmarks.
  virtual void check(int dimension, int count) const = 0;
};

}  // namespace pulson
