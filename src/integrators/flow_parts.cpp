#include "flow_parts.hpp"

#include "variational_maps.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Calls task(i, unit change) for each parameter of the noise.
template <class Task>
void for_each_parameter(const VectorXd& parameters_bar, const Task& task) {
  for (Eigen::Index i = 0; i < parameters_bar.size(); ++i) task(i, VectorXd::Unit(parameters_bar.size(), i));
}

}  // namespace

ImplicitRoot FlowPart::positions(const PhaseState& start, RootSearch search) const {
  return solve_implicit(PositionMap(system_, start.p, dt_, compensates_), start.q, search);
}

Points FlowPart::momenta(const PhaseState& at) const {
  const NoiseModel& noise = *system_.noise;
  Points force = -hamiltonian_q(system_.kernel, at.q, at.p);
  if (compensates_) force -= noise.compensation_gradient(at).q;
  if (noise.friction() > 0) force -= noise.friction() * hamiltonian_p(system_.kernel, at.q, at.p);
  return at.p + dt_ * force;
}

PhaseState FlowPart::tangent(const PhaseState& at, const PhaseState& change, const VectorXd& parameters) const {
  const Points& q = at.q;
  const Points& p = at.p;
  const KernelOperator& kernel = system_.kernel;
  const NoiseModel& noise = *system_.noise;
  const bool by_parameters = parameters.size() > 0;
  const PositionMap map(system_, p, dt_, compensates_);
  PhaseState of_g;
  if (compensates_ && by_parameters) of_g = noise.compensation_by_parameters(at, parameters);
  Points dq = change.q + dt_ * kernel.apply(q, q, change.p);
  if (compensates_ && by_parameters) dq += dt_ * of_g.p;
  dq = solve_linear([&](const Points& x) { return map.tangent(q, x); }, [&] { return map.jacobian(q); }, dq);

  Points force = -kernel.hessian(q, p, dq) - kernel.gradient(q, change.p, p);
  if (compensates_) force -= noise.compensation_hessian(at, {dq, change.p}).q;
  if (compensates_ && by_parameters) force -= of_g.q;
  if (!noise.traits().hamiltonian) {
    force -= noise.friction() * (kernel.apply_tangent(q, p, dq) + kernel.apply(q, q, change.p));
    if (by_parameters) force -= noise.friction_by_parameters(parameters) * kernel.apply(q, q, p);
  }
  return {dq, change.p + dt_ * force};
}

// The equations of the tangent read backwards; all second derivatives are symmetric.
PhaseState FlowPart::adjoint(const PhaseState& at, const PhaseState& end_bar, VectorXd& parameters_bar) const {
  const Points& q = at.q;
  const Points& p = at.p;
  const KernelOperator& kernel = system_.kernel;
  const NoiseModel& noise = *system_.noise;
  const bool hamiltonian = noise.traits().hamiltonian;
  Points q_bar = end_bar.q - dt_ * kernel.hessian(q, p, end_bar.p);
  Points p_bar = end_bar.p - dt_ * kernel.apply_tangent(q, p, end_bar.p);
  if (compensates_) {
    const PhaseState of_g = noise.compensation_hessian(at, {end_bar.p, Points::Zero(q.rows(), q.cols())});
    q_bar -= dt_ * of_g.q;
    p_bar -= dt_ * of_g.p;
  }
  if (!hamiltonian) {
    q_bar -= dt_ * noise.friction() * kernel.gradient(q, end_bar.p, p);
    p_bar -= dt_ * noise.friction() * kernel.apply(q, q, end_bar.p);
  }
  const PositionMap map(system_, p, dt_, compensates_);
  const Points mu = solve_linear([&](const Points& x) { return map.transposed(q, x); },
                                 [&]() -> MatrixXd { return map.jacobian(q).transpose(); }, q_bar);
  p_bar += dt_ * kernel.apply(q, q, mu);
  for_each_parameter(parameters_bar, [&](Eigen::Index i, const VectorXd& unit) {
    if (compensates_) {
      const PhaseState of_g = noise.compensation_by_parameters(at, unit);
      parameters_bar[i] += dt_ * (inner_product(mu, of_g.p) - inner_product(end_bar.p, of_g.q));
    }
    if (!hamiltonian)
      parameters_bar[i] -= dt_ * noise.friction_by_parameters(unit) * inner_product(end_bar.p, kernel.apply(q, q, p));
  });
  return {mu, p_bar};
}

ImplicitRoot AdjointFlowPart::momenta(const PhaseState& start, RootSearch search) const {
  return solve_implicit(KickMap(system_, start.q, start.p, dt_), start.p, search);
}

Points AdjointFlowPart::positions(const PhaseState& at) const {
  return at.q + dt_ * hamiltonian_p(system_.kernel, at.q, at.p);
}

PhaseState AdjointFlowPart::tangent(const PhaseState& at, const PhaseState& change, const VectorXd& parameters) const {
  const Points& q = at.q;
  const Points& p = at.p;
  const KernelOperator& kernel = system_.kernel;
  const NoiseModel& noise = *system_.noise;
  const KickMap map(system_, q, p, dt_);
  const Points by_q = kernel.apply_tangent(q, p, change.q);
  Points dp = change.p - dt_ * kernel.hessian(q, p, change.q);
  if (!noise.traits().hamiltonian) {
    dp -= dt_ * noise.friction() * by_q;
    if (parameters.size() > 0) dp -= dt_ * noise.friction_by_parameters(parameters) * kernel.apply(q, q, p);
  }
  dp = solve_linear([&](const Points& x) { return map.tangent(p, x); }, [&] { return map.jacobian(p); }, dp);
  return {change.q + dt_ * (by_q + kernel.apply(q, q, dp)), dp};
}

PhaseState AdjointFlowPart::adjoint(const PhaseState& at, const PhaseState& end_bar, VectorXd& parameters_bar) const {
  const Points& q = at.q;
  const Points& p = at.p;
  const KernelOperator& kernel = system_.kernel;
  const NoiseModel& noise = *system_.noise;
  const KickMap map(system_, q, p, dt_);
  const Points nu = solve_linear([&](const Points& x) { return map.transposed(p, x); },
                                 [&]() -> MatrixXd { return map.jacobian(p).transpose(); },
                                 end_bar.p + dt_ * kernel.apply(q, q, end_bar.q));
  // Friction acts as part of the force: −λ(H_pq)ᵀν joins (H_pq)ᵀ q̄'.
  const Points of_velocity = noise.traits().hamiltonian ? end_bar.q : Points(end_bar.q - noise.friction() * nu);
  if (!noise.traits().hamiltonian)
    for_each_parameter(parameters_bar, [&](Eigen::Index i, const VectorXd& unit) {
      parameters_bar[i] -= dt_ * noise.friction_by_parameters(unit) * inner_product(nu, kernel.apply(q, q, p));
    });
  return {end_bar.q + dt_ * (kernel.gradient(q, of_velocity, p) - kernel.hessian(q, p, nu)), nu};
}

}  // namespace pulson
