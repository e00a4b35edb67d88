#include "dynamics/effective_hamiltonian.hpp"

#include <utility>

namespace pulson {

EffectiveHamiltonian::EffectiveHamiltonian(StochasticSystem system, double lambda)
    : system_(std::move(system)), lambda_(lambda), noisy_(system_.noise->traits().moves_positions) {}

double EffectiveHamiltonian::value(const PhaseState& state) const {
  const double smooth = hamiltonian(system_.kernel, state);
  return noisy_ ? smooth + 0.5 * lambda_ * system_.noise->potentials(state).squaredNorm() : smooth;
}

Eigen::VectorXd EffectiveHamiltonian::controls(const PhaseState& state) const {
  return lambda_ * system_.noise->potentials(state);
}

Points EffectiveHamiltonian::velocity(const PhaseState& state) const {
  Points v = hamiltonian_p(system_.kernel, state.q, state.p);
  if (noisy_) v += system_.noise->gradient(state, controls(state)).p;
  return v;
}

Points EffectiveHamiltonian::force(const PhaseState& state) const {
  Points f = hamiltonian_q(system_.kernel, state.q, state.p);
  if (noisy_) f += system_.noise->gradient(state, controls(state)).q;
  return f;
}

Points EffectiveHamiltonian::velocity_change(const PhaseState& state, const Points& dq) const {
  Points dv = system_.kernel.apply_tangent(state.q, state.p, dq);
  if (!noisy_) return dv;
  const PhaseState change{dq, Points::Zero(dq.rows(), dq.cols())};
  const NoiseModel& noise = *system_.noise;
  dv += noise.hessian(state, controls(state), change).p;
  dv += noise.gradient(state, lambda_ * noise.contract(state, change)).p;
  return dv;
}

Points EffectiveHamiltonian::force_change(const PhaseState& state, const PhaseState& change) const {
  Points df = system_.kernel.hessian(state.q, state.p, change.q) + system_.kernel.gradient(state.q, change.p, state.p);
  if (!noisy_) return df;
  const NoiseModel& noise = *system_.noise;
  df += noise.hessian(state, controls(state), change).q;
  df += noise.gradient(state, lambda_ * noise.contract(state, change)).q;
  return df;
}

}  // namespace pulson
