#include <algorithm>

#include "core/text.hpp"
#include "integrators/schemes.hpp"
#include "variational_parts.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// F(q) = ½ h_w,p(q): the positions of the midpoint, which need no momenta as h_w is affine in p.
class NoisePositionMap final : public ImplicitMap {
 public:
  NoisePositionMap(const NoiseModel& noise, const Points& p, const VectorXd& w) : noise_(noise), p_(p), w_(w) {}

  Points value(const Points& q) const override { return 0.5 * noise_.gradient({q, p_}, w_).p; }
  MatrixXd jacobian(const Points& q) const override {
    const Points zero = Points::Zero(q.rows(), q.cols());
    return matrix_of(
        [&](const Points& delta) -> Points {
          return 0.5 * noise_.hessian({q, p_}, w_, {delta, zero}).p;
        },
        q.rows(), q.cols());
  }
  VectorXd rounding_scale() const override { return VectorXd::Zero(1); }
  // As of the midpoint rule: nothing else guards against an iteration that jumps to another root.
  double contraction() const override { return 0.5; }

 private:
  const NoiseModel& noise_;
  const Points& p_;
  const VectorXd& w_;
};

// The noise of a step, and how its roots were found.
struct NoiseOutcome {
  PhaseState middle;
  PhaseState end;
  bool found = true;
  bool continued = false;
  double contraction = 0;
};

// The flow of h_w: what ∇h_w adds where it is constant, else the midpoint rule, positions first.
NoiseOutcome through_noise(const NoiseModel& noise, const VectorXd& w, const PhaseState& start, RootSearch search) {
  if (w.size() == 0) return {start, start};
  const NoiseTraits traits = noise.traits();
  NoiseOutcome outcome{start, {}};
  if (!traits.additive && traits.moves_positions()) {
    ImplicitRoot root = solve_implicit(NoisePositionMap(noise, start.p, w), start.q, search);
    outcome.middle.q = std::move(root.x);
    outcome.found = root.found;
    outcome.continued = root.continued;
    outcome.contraction = root.contraction;
  }
  if (outcome.found && !traits.additive && traits.moves_momenta) {
    const VectorXd half = 0.5 * w;
    ImplicitRoot root = solve_implicit(MomentumMap(noise, outcome.middle.q, half), start.p, search);
    outcome.middle.p = std::move(root.x);
    outcome.found = root.found;
    outcome.continued |= root.continued;
  }
  // Not 2m − z: total momentum is kept to round-off by adding up forces that cancel.
  const PhaseState h = noise.gradient(outcome.middle, w);
  outcome.end = {start.q + h.p, start.p - h.q};
  if (traits.additive) outcome.middle = 0.5 * (start + outcome.end);
  return outcome;
}

}  // namespace

Integrator::StepOutcome SymmetricVariationalIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                                double dt, const VectorXd& w, RootSearch search) const {
  const AdjointFlowPart first(system, dt / 2);
  const FlowPart second(system, dt / 2, false);
  ImplicitRoot kick = first.momenta(start, search);
  if (!kick.found) return {.end = {}, .stage_momenta = {}, .found = false};
  const Points q = first.positions({start.q, kick.x});
  const NoiseOutcome noise = through_noise(*system.noise, w, {q, kick.x}, search);
  if (!noise.found) return {.end = {}, .stage_momenta = {}, .found = false};
  ImplicitRoot drift = second.positions(noise.end, search);
  Points p = second.momenta({drift.x, noise.end.p});
  return {.end = {std::move(drift.x), std::move(p)},
          .stage_momenta = std::move(kick.x),
          .found = drift.found,
          .continued = kick.continued || noise.continued || drift.continued,
          .contraction = std::max({kick.contraction, noise.contraction, drift.contraction})};
}

SymmetricVariationalIntegrator::Parts SymmetricVariationalIntegrator::parts_of(const Step& step) {
  const PhaseState first{step.start.q, step.momenta};
  if (step.w.size() == 0) return {first, {}, {step.end.q, step.momenta}};
  const PhaseState before{AdjointFlowPart(step.system, step.dt / 2).positions(first), step.momenta};
  NoiseOutcome noise = through_noise(*step.system.noise, step.w, before, RootSearch::kThorough);
  return {first, std::move(noise.middle), {step.end.q, std::move(noise.end.p)}};
}

PhaseState SymmetricVariationalIntegrator::do_tangent(const Step& step, const PhaseState& start_change,
                                                      const VectorXd& w_change,
                                                      const VectorXd& parameters_change) const {
  const Parts at = parts_of(step);
  PhaseState change = AdjointFlowPart(step.system, step.dt / 2).tangent(at.first, start_change, parameters_change);
  if (step.w.size() > 0)
    change = MidpointStep(step.system, 0, step.w).tangent(at.noise, change, w_change, parameters_change);
  return FlowPart(step.system, step.dt / 2, false).tangent(at.second, change, parameters_change);
}

Integrator::StepBar SymmetricVariationalIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const Parts at = parts_of(step);
  StepBar bar{{}, VectorXd::Zero(step.w.size()), VectorXd::Zero(step.parameters)};
  bar.start = FlowPart(step.system, step.dt / 2, false).adjoint(at.second, end_bar, bar.parameters);
  if (step.w.size() > 0)
    bar.start = MidpointStep(step.system, 0, step.w).adjoint(at.noise, bar.start, bar.w, bar.parameters);
  bar.start = AdjointFlowPart(step.system, step.dt / 2).adjoint(at.first, bar.start, bar.parameters);
  return bar;
}

SpaceStep SymmetricVariationalIntegrator::do_space(const Step& step) const {
  Parts at = parts_of(step);
  const double half = step.dt / 2;
  SpaceStep space;
  if (step.w.size() == 0) {
    space.stages = {std::move(at.first), std::move(at.second)};
    space.drift = (Eigen::Matrix<double, 3, 2>() << 0, 0, half, half, half, half).finished();
    space.noise = MatrixXd::Zero(3, 2);
    return space;
  }
  space.stages = {std::move(at.first), std::move(at.noise), std::move(at.second)};
  space.drift = MatrixXd::Zero(4, 3);
  space.drift.col(0).tail(3).setConstant(half);
  space.drift.col(2).tail(2).setConstant(half);
  space.noise = MatrixXd::Zero(4, 3);
  space.noise.col(1).tail(3) << 0.5, 1, 1;
  return space;
}

// ∂q(T)/∂p0, and by the increments where these are wanted, dN×CK.
MatrixXd SymmetricVariationalIntegrator::rows(const StochasticSystem& system, const Trajectory& path,
                                              MatrixXd* by_increments) const {
  const Points& q0 = path.initial().q;
  const Eigen::Index channels = path.increments.rows();
  RowSweep sweep(system, path.grid.dt() / 2, false, q0.rows(), q0.cols());
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const Step step = step_of(system, path, k, path.increments);
    const Parts at = parts_of(step);
    sweep.through_flow(at.second.q, at.second.p);
    MatrixXd by_w = MatrixXd::Zero(q0.size(), by_increments != nullptr ? channels : 0);
    if (channels > 0) sweep.through_midpoint_noise(at.noise, step.w, by_w);
    if (by_increments != nullptr) by_increments->middleCols(k * channels, channels) = by_w;
    sweep.through_adjoint_flow(at.first.q, at.first.p);
  }
  return sweep.p_bar().transpose();
}

EndpointJacobian SymmetricVariationalIntegrator::endpoint_jacobian(const StochasticSystem& system,
                                                                   const Trajectory& path) const {
  EndpointJacobian jacobian{{}, MatrixXd(path.initial().q.size(), path.increments.size())};
  jacobian.momenta = rows(system, path, &jacobian.increments);
  return jacobian;
}

MatrixXd SymmetricVariationalIntegrator::endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                                          const MatrixXd& momentum_changes) const {
  require_size("the changes of the momenta", momentum_changes, path.initial().p.size(), momentum_changes.cols());
  if (!changes_need_no_noise(system.noise->traits())) {
    if (rows_cost_less(path, momentum_changes)) return rows(system, path, nullptr) * momentum_changes;
    return Integrator::endpoint_changes(system, path, momentum_changes);
  }
  std::vector<FlowSegment> segments;
  for (int k = 0; k < path.grid.steps; ++k) {
    const auto i = static_cast<std::size_t>(k);
    segments.push_back({path.states[i].q, path.step_momenta(k), path.grid.dt() / 2, true});
    segments.push_back({path.states[i + 1].q, path.step_momenta(k), path.grid.dt() / 2, false});
  }
  return changes_along(system.kernel, path.initial().p, segments, momentum_changes);
}

}  // namespace pulson
