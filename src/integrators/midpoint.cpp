#include "pulson/integrators/midpoint.hpp"

#include "implicit_step.hpp"
#include "step_field.hpp"

namespace pulson {
namespace {

using Eigen::VectorXd;

// [q p], d×2N.
Points joined(const PhaseState& z) {
  Points x(z.q.rows(), 2 * z.q.cols());
  x << z.q, z.p;
  return x;
}

PhaseState parted(const Points& x) {
  const Eigen::Index n = x.cols() / 2;
  return {x.leftCols(n), x.rightCols(n)};
}

// The map m ↦ ½F(m).
class MidpointMap final : public ImplicitMap {
 public:
  MidpointMap(const StochasticSystem& system, double dt, const VectorXd& w, const PhaseState& start)
      : system_(system), field_(system, dt, w), dt_(dt), start_(start) {}

  Points value(const Points& m) const override { return 0.5 * joined(field_.value(parted(m))); }
  Eigen::MatrixXd jacobian(const Points& m) const override {
    return matrix_of([&](const Points& x) { return tangent(m, x); }, m.rows(), m.cols());
  }
  Points tangent(const Points& m, const Points& delta) const {
    return 0.5 * joined(field_.tangent(parted(m), parted(delta)));
  }
  Points transposed(const Points& m, const Points& mu) const {
    return 0.5 * joined(field_.transposed(parted(m), parted(mu)));
  }
  VectorXd terms_size() const override {
    const double total = start_.p.colwise().norm().sum();
    return Eigen::Vector2d(dt_ * system_.kernel.at_zero() * total, dt_ * system_.kernel.lipschitz() * total * total);
  }
  // Stricter than for positions alone: nothing else guards against an iteration that jumps to another root.
  double contraction() const override { return 0.5; }

  const StepField& field() const { return field_; }

 private:
  const StochasticSystem& system_;
  StepField field_;
  double dt_;
  const PhaseState& start_;
};

Points midpoint(const PhaseState& a, const PhaseState& b) { return 0.5 * joined(a + b); }

}  // namespace

Integrator::StepOutcome MidpointIntegrator::do_step(const StochasticSystem& system, const PhaseState& start, double dt,
                                                    const VectorXd& w, RootSearch search) const {
  const MidpointMap map(system, dt, w, start);
  const ImplicitRoot root = solve_implicit(map, joined(start), search);
  // Not 2m − z: total momentum is kept to round-off by adding up forces that cancel.
  return {.end = start + map.field().value(parted(root.x)),
          .inner = {},
          .found = root.found,
          .continued = root.continued,
          .contraction = root.contraction};
}

PhaseState MidpointIntegrator::do_tangent(const Step& step, const PhaseState& start_change, const VectorXd& w_change,
                                          const VectorXd& parameters_change) const {
  const MidpointMap map(step.system, step.dt, step.w, step.start);
  const Points m = midpoint(step.start, step.end);
  const PhaseState forcing = map.field().forced(parted(m), w_change, parameters_change);
  const Points delta = solve_linear([&](const Points& x) { return map.tangent(m, x); }, [&] { return map.jacobian(m); },
                                    joined(start_change + 0.5 * forcing), 2);
  return 2 * parted(delta) + -1 * start_change;
}

Integrator::StepBar MidpointIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const MidpointMap map(step.system, step.dt, step.w, step.start);
  const Points m = midpoint(step.start, step.end);
  const PhaseState nu =
      parted(solve_linear([&](const Points& x) { return map.transposed(m, x); },
                          [&]() -> Eigen::MatrixXd { return map.jacobian(m).transpose(); }, joined(2 * end_bar), 2));
  StepBar bar{nu + -1 * end_bar, VectorXd::Zero(step.w.size()), VectorXd::Zero(step.system.noise->parameters().size())};
  map.field().add_forced_transposed(parted(m), 0.5 * nu, bar.w, bar.parameters);
  return bar;
}

SpaceStep MidpointIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = {parted(midpoint(step.start, step.end))};
  space.noise = Eigen::Vector2d(0.5, 1);
  space.drift = step.dt * space.noise;
  return space;
}

}  // namespace pulson
