#include "integrators/schemes.hpp"

namespace pulson {

namespace {
using Eigen::VectorXd;

// [q p], d×2N.
Points stack(const PhaseState& z) {
  Points x(z.q.rows(), 2 * z.q.cols());
  x << z.q, z.p;
  return x;
}

PhaseState unstack(const Points& x) {
  const Eigen::Index n = x.cols() / 2;
  return {x.leftCols(n), x.rightCols(n)};
}

// The map m ↦ ½F(m).
class MidpointMap final : public ImplicitMap {
 public:
  /// @param momenta that bound the terms of the flow
  MidpointMap(const StochasticSystem& system, const StepField& field, double dt, const Points& momenta)
      : system_(system), field_(field), dt_(dt), momenta_(momenta) {}

  Points value(const Points& m) const override { return 0.5 * stack(field_.value(unstack(m))); }
  Eigen::MatrixXd jacobian(const Points& m) const override {
    return matrix_of([&](const Points& x) { return tangent(m, x); }, m.rows(), m.cols());
  }
  Points tangent(const Points& m, const Points& delta) const {
    return 0.5 * stack(field_.tangent(unstack(m), unstack(delta)));
  }
  Points transposed(const Points& m, const Points& mu) const {
    return 0.5 * stack(field_.transposed(unstack(m), unstack(mu)));
  }
  VectorXd rounding_scale() const override {
    const double total = momenta_.colwise().norm().sum();
    return Eigen::Vector2d(dt_ * system_.kernel.at_zero() * total, dt_ * system_.kernel.lipschitz() * total * total);
  }
  // Stricter than for positions alone: nothing else guards against an iteration that jumps to another root.
  double contraction() const override { return 0.5; }

 private:
  const StochasticSystem& system_;
  const StepField& field_;
  double dt_;
  const Points& momenta_;
};

}  // namespace

MidpointStep::Outcome MidpointStep::take(const PhaseState& start, RootSearch search) const {
  const ImplicitRoot root = solve_implicit(MidpointMap(system_, field_, dt_, start.p), stack(start), search);
  Outcome outcome{unstack(root.x), {}, root.found, root.continued, root.contraction};
  // Not 2m − z: total momentum is kept to round-off by adding up forces that cancel.
  outcome.end = start + field_.value(outcome.middle);
  return outcome;
}

PhaseState MidpointStep::tangent(const PhaseState& middle, const PhaseState& change, const VectorXd& w_change,
                                 const VectorXd& parameters) const {
  const MidpointMap map(system_, field_, dt_, middle.p);
  const Points m = stack(middle);
  const PhaseState forcing = field_.forced(middle, w_change, parameters);
  const Points delta = solve_linear([&](const Points& x) { return map.tangent(m, x); }, [&] { return map.jacobian(m); },
                                    stack(change + 0.5 * forcing), 2);
  return 2 * unstack(delta) + -1 * change;
}

PhaseState MidpointStep::adjoint(const PhaseState& middle, const PhaseState& end_bar, VectorXd& w_bar,
                                 VectorXd& parameters_bar) const {
  const MidpointMap map(system_, field_, dt_, middle.p);
  const Points m = stack(middle);
  const PhaseState nu =
      unstack(solve_linear([&](const Points& x) { return map.transposed(m, x); },
                           [&]() -> Eigen::MatrixXd { return map.jacobian(m).transpose(); }, stack(2 * end_bar), 2));
  field_.add_forced_transposed(middle, 0.5 * nu, w_bar, parameters_bar);
  return nu + -1 * end_bar;
}

namespace {
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
  StepBar bar{{}, VectorXd::Zero(step.w.size()), VectorXd::Zero(step.parameters)};
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
