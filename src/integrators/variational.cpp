#include "core/text.hpp"
#include "integrators/schemes.hpp"
#include "variational_parts.hpp"

namespace pulson {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Integrator::StepOutcome VariationalIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                       double dt, const VectorXd& w, RootSearch search) const {
  const NoiseModel& noise = *system.noise;
  const NoiseTraits traits = noise.traits();
  StepOutcome outcome;
  if (traits.moves_momenta) {
    ImplicitRoot root = solve_implicit(MomentumMap(noise, start.q, w), start.p, search);
    if (!root.found) return {.end = {}, .stage_momenta = {}, .found = false};
    outcome.stage_momenta = std::move(root.x);
    outcome.continued = root.continued;
  }
  const Points& p = traits.moves_momenta ? outcome.stage_momenta : start.p;
  Points c = start.q;
  if (traits.moves_positions()) c += noise.gradient({start.q, p}, w).p;

  const FlowPart flow(system, dt, compensates(noise));
  ImplicitRoot root = flow.positions({c, p}, search);
  outcome.found = root.found;
  outcome.continued |= root.continued;
  outcome.contraction = root.contraction;
  outcome.end.p = flow.momenta({root.x, p});
  outcome.end.q = std::move(root.x);
  return outcome;
}

PhaseState VariationalIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                             const VectorXd& parameters_change) const {
  const NoiseModel& noise = *step.system.noise;
  const Points& p = step.momenta;
  const Points zero = Points::Zero(p.rows(), p.cols());
  const PhaseState inside{step.start.q, p};

  PhaseState forcing{zero, zero};  // what changes of w and θ add to ∇h_w
  if (step.w.size() > 0) {
    forcing = noise.gradient(inside, w_change);
    if (parameters_change.size() > 0) {
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
  if (traits.moves_positions()) {
    if (!traits.additive) dq += noise.hessian(inside, step.w, {start_change.q, dp}).p;
    dq += forcing.p;
  }

  return FlowPart(step.system, step.dt, compensates(noise)).tangent({step.end.q, p}, {dq, dp}, parameters_change);
}

// The equations of do_tangent read backwards; all second derivatives are symmetric.
Integrator::StepBar VariationalIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const NoiseModel& noise = *step.system.noise;
  const NoiseTraits traits = noise.traits();
  const Points& p = step.momenta;
  const Points zero = Points::Zero(p.rows(), p.cols());

  StepBar bar{{}, {}, VectorXd::Zero(step.parameters)};
  bar.start = FlowPart(step.system, step.dt, compensates(noise)).adjoint({step.end.q, p}, end_bar, bar.parameters);
  const Points mu = bar.start.q;
  const PhaseState inside{step.start.q, p};
  Points nu = zero;
  if (traits.moves_positions() && !traits.additive) {
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
        [&]() -> MatrixXd { return momenta.jacobian(p).transpose(); }, bar.start.p);
    bar.start.p = nu;
    bar.start.q -= noise.hessian(inside, step.w, {nu, zero}).q;
  }
  bar.w = noise.contract(inside, {-nu, mu});

  for (Eigen::Index i = 0; i < bar.parameters.size(); ++i) {
    const PhaseState of_h = noise.gradient_by_parameters(inside, step.w, VectorXd::Unit(bar.parameters.size(), i));
    bar.parameters[i] += mu.cwiseProduct(of_h.p).sum() - nu.cwiseProduct(of_h.q).sum();
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

// ∂q(T)/∂p0, and by the increments that act in each step where these are wanted, dN×CK.
MatrixXd VariationalIntegrator::rows(const StochasticSystem& system, const Trajectory& path,
                                     MatrixXd* by_acting) const {
  const Points& q0 = path.initial().q;
  const Eigen::Index channels = path.increments.rows();
  const MatrixXd w = acting_increments(path.increments);
  RowSweep sweep(system, path.grid.dt(), compensates(*system.noise), q0.rows(), q0.cols());
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const Step step = step_of(system, path, k, w);
    sweep.through_flow(step.end.q, step.momenta);
    MatrixXd by_w = MatrixXd::Zero(q0.size(), by_acting != nullptr ? channels : 0);
    sweep.through_noise({step.start.q, step.momenta}, step.w, by_w);
    if (by_acting != nullptr) by_acting->middleCols(k * channels, channels) = by_w;
  }
  return sweep.p_bar().transpose();
}

EndpointJacobian VariationalIntegrator::endpoint_jacobian(const StochasticSystem& system,
                                                          const Trajectory& path) const {
  const Eigen::Index channels = path.increments.rows();
  MatrixXd by_w(path.initial().q.size(), channels * path.grid.steps);
  MatrixXd by_p0 = rows(system, path, &by_w);
  EndpointJacobian jacobian{std::move(by_p0), 0.5 * by_w};
  const Eigen::Index later = channels * (path.grid.steps - 1);
  jacobian.increments.leftCols(later) += 0.5 * by_w.rightCols(later);
  return jacobian;
}

MatrixXd VariationalIntegrator::endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                                 const MatrixXd& momentum_changes) const {
  require_size("the changes of the momenta", momentum_changes, path.initial().p.size(), momentum_changes.cols());
  if (!changes_need_no_noise(system.noise->traits())) {
    if (rows_cost_less(path, momentum_changes)) return rows(system, path, nullptr) * momentum_changes;
    return Integrator::endpoint_changes(system, path, momentum_changes);
  }
  std::vector<FlowSegment> segments;
  for (int k = 0; k < path.grid.steps; ++k)
    segments.push_back({path.states[static_cast<std::size_t>(k) + 1].q, path.step_momenta(k), path.grid.dt(), false});
  return changes_along(system.kernel, path.initial().p, segments, momentum_changes);
}

}  // namespace pulson
