#include <algorithm>
#include <utility>
#include <vector>

#include "dynamics/effective_hamiltonian.hpp"
#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

double hamiltonian(const KernelOperator& kernel, const PhaseState& state) {
  return 0.5 * state.p.cwiseProduct(hamiltonian_p(kernel, state.q, state.p)).sum();
}

Points hamiltonian_p(const KernelOperator& kernel, const Points& q, const Points& p) { return kernel.apply(q, q, p); }

Points hamiltonian_q(const KernelOperator& kernel, const Points& q, const Points& p) {
  return 0.5 * kernel.gradient(q, p, p);
}

double contraction_bound(const KernelOperator& kernel, const Points& p, double dt) {
  const Eigen::VectorXd sizes = p.colwise().norm();
  const double total = sizes.sum();
  std::vector<Eigen::Index> columns;  // of landmarks without momentum two stand for all
  int at_rest = 0;
  for (Eigen::Index a = 0; a < p.cols(); ++a)
    if (sizes[a] != 0 || ++at_rest <= 2) columns.push_back(a);
  double largest = 0;
  for (std::size_t b = 1; b < columns.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      largest = std::max(largest, (p.col(columns[a]) - p.col(columns[b])).norm() +
                                      2 * (total - sizes[columns[a]] - sizes[columns[b]]));
  return dt * kernel.lipschitz() * largest;
}

EffectiveHamiltonian::EffectiveHamiltonian(StochasticSystem system, double lambda)
    : system_(std::move(system)), lambda_(lambda), noisy_(system_.noise->traits().moves_positions()) {}

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

Flow EffectiveHamiltonian::flow(const PhaseState& state) const {
  Flow flow = system_.kernel.flow(state.q, state.p);
  if (!noisy_) return flow;
  const PhaseState of_noise = system_.noise->gradient(state, controls(state));
  flow.velocity += of_noise.p;
  flow.force += of_noise.q;
  return flow;
}

Flow EffectiveHamiltonian::flow_change(const PhaseState& state, const PhaseState& change) const {
  Flow flow = system_.kernel.flow_tangent(state.q, state.p, change.q, change.p);
  if (!noisy_) return flow;
  const NoiseModel& noise = *system_.noise;
  const PhaseState bent = noise.hessian(state, controls(state), change);
  const PhaseState driven = noise.gradient(state, lambda_ * noise.contract(state, change));
  flow.velocity += bent.p + driven.p;
  flow.force += bent.q + driven.q;
  return flow;
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
  Points df = system_.kernel.flow_tangent(state.q, state.p, change.q, change.p).force;
  if (!noisy_) return df;
  const NoiseModel& noise = *system_.noise;
  df += noise.hessian(state, controls(state), change).q;
  df += noise.gradient(state, lambda_ * noise.contract(state, change)).q;
  return df;
}

}  // namespace pulson
