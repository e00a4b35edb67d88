#include "integrators/midpoint.hpp"

#include "midpoint_step.hpp"

namespace pulson {
namespace {

using Eigen::VectorXd;

PhaseState middle_of(const PhaseState& a, const PhaseState& b) { return 0.5 * (a + b); }

}  // namespace

Integrator::StepOutcome MidpointIntegrator::do_step(const StochasticSystem& system, const PhaseState& start, double dt,
                                                    const VectorXd& w, RootSearch search) const {
  MidpointStep::Outcome outcome = MidpointStep(system, dt, w).take(start, search);
  return {.end = std::move(outcome.end),
          .stage_momenta = {},
          .found = outcome.found,
          .continued = outcome.continued,
          .contraction = outcome.contraction};
}

PhaseState MidpointIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                          const VectorXd& parameters_change) const {
  return MidpointStep(step.system, step.dt, step.w)
      .tangent(middle_of(step.start, step.end), start_change, w_change, parameters_change);
}

Integrator::StepBar MidpointIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  StepBar bar{{}, VectorXd::Zero(step.w.size()), VectorXd::Zero(step.system.noise->parameters().size())};
  bar.start = MidpointStep(step.system, step.dt, step.w)
                  .adjoint(middle_of(step.start, step.end), end_bar, bar.w, bar.parameters);
  return bar;
}

SpaceStep MidpointIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = {middle_of(step.start, step.end)};
  space.noise = Eigen::Vector2d(0.5, 1);
  space.drift = step.dt * space.noise;
  return space;
}

}  // namespace pulson
