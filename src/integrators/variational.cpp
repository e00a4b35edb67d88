#include "pulson/integrators/variational.hpp"

#include "variational_maps.hpp"

namespace pulson {

using Eigen::VectorXd;

Integrator::StepOutcome VariationalIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                       double dt, const VectorXd& w, RootSearch search) const {
  const NoiseModel& noise = *system.noise;
  const NoiseTraits traits = noise.traits();
  StepOutcome outcome;
  if (traits.moves_momenta) {
    ImplicitRoot root = solve_implicit(MomentumMap(noise, start.q, w), start.p, search);
    if (!root.found) return {.end = {}, .inner = {}, .found = false};
    outcome.inner = std::move(root.x);
    outcome.continued = root.continued;
  }
  const Points& p = traits.moves_momenta ? outcome.inner : start.p;
  Points c = start.q;
  if (traits.moves_positions) c += noise.gradient({start.q, p}, w).p;

  const bool compensates = this->compensates(noise);
  ImplicitRoot root = solve_implicit(PositionMap(system, p, dt, compensates), c, search);
  outcome.found = root.found;
  outcome.continued |= root.continued;
  outcome.contraction = root.contraction;
  Points force = -hamiltonian_q(system.kernel, root.x, p);
  if (compensates) force -= noise.compensation_gradient({root.x, p}).q;
  if (noise.friction() > 0) force -= noise.friction() * hamiltonian_p(system.kernel, root.x, p);
  outcome.end.p = p + dt * force;
  outcome.end.q = std::move(root.x);
  return outcome;
}

PhaseState VariationalIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                             const VectorXd& parameters_change) const {
  const NoiseModel& noise = *step.system.noise;
  const KernelOperator& kernel = step.system.kernel;
  const Points& p = step.momenta;
  const Points& q = step.end.q;
  const Points zero = Points::Zero(q.rows(), q.cols());
  const PhaseState inside{step.start.q, p};
  const bool by_parameters = parameters_change.size() > 0;

  PhaseState forcing{zero, zero};  // what changes of w and θ add to ∇h_w
  if (step.w.size() > 0) {
    forcing = noise.gradient(inside, w_change);
    if (by_parameters) {
      const PhaseState more = noise.gradient_by_parameters(inside, step.w, parameters_change);
      forcing.q += more.q;
      forcing.p += more.p;
    }
  }
  Points dp = start_change.p;
  Points dq = start_change.q;
  const NoiseTraits traits = noise.traits();
  if (traits.moves_momenta) {
    dp -= forcing.q + noise.hessian(inside, step.w, {dq, zero}).q;
    const MomentumMap map(noise, step.start.q, step.w);
    dp = solve_linear(
        [&](const Points& x) -> Points {
          return -noise.hessian(inside, step.w, {zero, x}).q;
        },
        [&] { return map.jacobian(p); }, dp);
  }
  if (traits.moves_positions) {
    if (!traits.additive) dq += noise.hessian(inside, step.w, {start_change.q, dp}).p;
    dq += forcing.p;
  }

  const bool compensates = this->compensates(noise);
  const PositionMap map(step.system, p, step.dt, compensates);
  PhaseState of_g{zero, zero};
  if (compensates && by_parameters) of_g = noise.compensation_by_parameters({q, p}, parameters_change);
  dq += step.dt * (kernel.apply(q, q, dp) + of_g.p);
  dq = solve_linear([&](const Points& x) { return map.tangent(q, x); }, [&] { return map.jacobian(q); }, dq);

  Points force = -kernel.hessian(q, p, dq) - kernel.gradient(q, dp, p);
  if (compensates) force -= noise.compensation_hessian({q, p}, {dq, dp}).q + of_g.q;
  if (!traits.hamiltonian) {
    force -= noise.friction() * (kernel.apply_tangent(q, p, dq) + kernel.apply(q, q, dp));
    if (by_parameters) force -= noise.friction_by_parameters(parameters_change) * kernel.apply(q, q, p);
  }
  return {dq, dp + step.dt * force};
}

// The equations of do_tangent read backwards; all second derivatives are symmetric.
Integrator::StepBar VariationalIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const NoiseModel& noise = *step.system.noise;
  const KernelOperator& kernel = step.system.kernel;
  const NoiseTraits traits = noise.traits();
  const Points& p = step.momenta;
  const Points& q = step.end.q;
  const Points zero = Points::Zero(q.rows(), q.cols());
  const double dt = step.dt;

  const bool compensates = this->compensates(noise);
  Points q_bar = end_bar.q - dt * kernel.hessian(q, p, end_bar.p);
  Points p_bar = end_bar.p - dt * kernel.apply_tangent(q, p, end_bar.p);
  if (compensates) {
    const PhaseState of_g = noise.compensation_hessian({q, p}, {end_bar.p, zero});
    q_bar -= dt * of_g.q;
    p_bar -= dt * of_g.p;
  }
  if (!traits.hamiltonian) {
    q_bar -= dt * noise.friction() * kernel.gradient(q, end_bar.p, p);
    p_bar -= dt * noise.friction() * kernel.apply(q, q, end_bar.p);
  }
  const PositionMap map(step.system, p, dt, compensates);
  const Points mu = solve_linear([&](const Points& x) { return map.transposed(q, x); },
                                 [&]() -> Eigen::MatrixXd { return map.jacobian(q).transpose(); }, q_bar);
  p_bar += dt * kernel.apply(q, q, mu);

  const PhaseState inside{step.start.q, p};
  StepBar bar{{mu, p_bar}, {}, {}};
  Points nu = zero;
  if (traits.moves_positions && !traits.additive) {
    const PhaseState of_h = noise.hessian(inside, step.w, {zero, mu});
    bar.start.q += of_h.q;
    bar.start.p += of_h.p;
  }
  if (traits.moves_momenta) {
    const MomentumMap momenta(noise, step.start.q, step.w);
    nu = solve_linear(
        [&](const Points& x) -> Points {
          return -noise.hessian(inside, step.w, {x, zero}).p;
        },
        [&]() -> Eigen::MatrixXd { return momenta.jacobian(p).transpose(); }, bar.start.p);
    bar.start.p = nu;
    bar.start.q -= noise.hessian(inside, step.w, {nu, zero}).q;
  }
  bar.w = noise.contract(inside, {-nu, mu});

  const VectorXd theta = noise.parameters();
  bar.parameters = VectorXd::Zero(theta.size());
  for (Eigen::Index i = 0; i < theta.size(); ++i) {
    const VectorXd unit = VectorXd::Unit(theta.size(), i);
    const PhaseState of_h = noise.gradient_by_parameters(inside, step.w, unit);
    bar.parameters[i] = mu.cwiseProduct(of_h.p).sum() - nu.cwiseProduct(of_h.q).sum();
    if (compensates) {
      const PhaseState of_g = noise.compensation_by_parameters({q, p}, unit);
      bar.parameters[i] += dt * (mu.cwiseProduct(of_g.p).sum() - end_bar.p.cwiseProduct(of_g.q).sum());
    }
    if (!traits.hamiltonian)
      bar.parameters[i] -=
          dt * noise.friction_by_parameters(unit) * end_bar.p.cwiseProduct(kernel.apply(q, q, p)).sum();
  }
  return bar;
}

// Noise acts where the step begins, the flow where it ends.
SpaceStep VariationalIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = {{step.start.q, step.momenta}, {step.end.q, step.momenta}};
  space.drift = (Eigen::Matrix<double, 3, 2>() << 0, 0, 0, step.dt, 0, step.dt).finished();
  space.noise = (Eigen::Matrix<double, 3, 2>() << 0, 0, 1, 0, 1, 0).finished();
  space.compensated = compensates(*step.system.noise);
  return space;
}

}  // namespace pulson
