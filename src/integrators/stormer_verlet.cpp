#include "pulson/integrators/stormer_verlet.hpp"

#include "variational_maps.hpp"

namespace pulson {
namespace {

using Eigen::VectorXd;

// F(p) = −½Δt H_q(q, p)
class HalfKick final : public ImplicitMap {
 public:
  HalfKick(const KernelOperator& kernel, const Points& q, const Points& p, double half_dt)
      : kernel_(kernel), q_(q), p_(p), half_dt_(half_dt) {}

  Points value(const Points& p) const override { return -half_dt_ * hamiltonian_q(kernel_, q_, p); }
  Eigen::MatrixXd jacobian(const Points& p) const override {
    return -half_dt_ * kernel_.tangent_matrix(q_, p).transpose();
  }
  VectorXd terms_size() const override {
    const double total = p_.colwise().norm().sum();
    return VectorXd::Constant(1, half_dt_ * kernel_.lipschitz() * total * total);
  }
  double contraction() const override { return 0.5; }

  Points tangent(const Points& p, const Points& delta) const { return -half_dt_ * kernel_.gradient(q_, delta, p); }
  Points transposed(const Points& p, const Points& mu) const { return -half_dt_ * kernel_.apply_tangent(q_, p, mu); }

 private:
  const KernelOperator& kernel_;
  const Points& q_;
  const Points& p_;
  double half_dt_;
};

}  // namespace

Integrator::StepOutcome StormerVerletIntegrator::do_step(const StochasticSystem& system, const PhaseState& start,
                                                         double dt, const VectorXd& /*w*/, RootSearch search) const {
  const KernelOperator& kernel = system.kernel;
  const ImplicitRoot kick = solve_implicit(HalfKick(kernel, start.q, start.p, dt / 2), start.p, search);
  if (!kick.found) return {.end = {}, .inner = {}, .found = false};
  const Points& p = kick.x;
  const Points c = start.q + dt / 2 * hamiltonian_p(kernel, start.q, p);
  const ImplicitRoot drift = solve_implicit(PositionMap(system, p, dt / 2, false), c, search);
  return {.end = {drift.x, p - dt / 2 * hamiltonian_q(kernel, drift.x, p)},
          .inner = p,
          .found = drift.found,
          .continued = kick.continued || drift.continued,
          .contraction = std::max(kick.contraction, drift.contraction)};
}

PhaseState StormerVerletIntegrator::do_tangent(const Step& step, const PhaseState& start_change,
                                               const VectorXd& /*w_change*/,
                                               const VectorXd& /*parameters_change*/) const {
  const KernelOperator& kernel = step.system.kernel;
  const double half = step.dt / 2;
  const Points& p = step.momenta;
  const Points& q = step.end.q;
  const HalfKick kick(kernel, step.start.q, p, half);
  const PositionMap drift(step.system, p, half, false);
  const Points dp = solve_linear([&](const Points& x) { return kick.tangent(p, x); }, [&] { return kick.jacobian(p); },
                                 start_change.p - half * kernel.hessian(step.start.q, p, start_change.q));
  const Points c = start_change.q + half * (kernel.apply_tangent(step.start.q, p, start_change.q) +
                                            kernel.apply(step.start.q, step.start.q, dp) + kernel.apply(q, q, dp));
  const Points dq =
      solve_linear([&](const Points& x) { return drift.tangent(q, x); }, [&] { return drift.jacobian(q); }, c);
  return {dq, dp - half * (kernel.hessian(q, p, dq) + kernel.gradient(q, dp, p))};
}

Integrator::StepBar StormerVerletIntegrator::do_adjoint(const Step& step, const PhaseState& end_bar) const {
  const KernelOperator& kernel = step.system.kernel;
  const double half = step.dt / 2;
  const Points& p = step.momenta;
  const Points& q0 = step.start.q;
  const Points& q = step.end.q;
  const HalfKick kick(kernel, q0, p, half);
  const PositionMap drift(step.system, p, half, false);
  const Points mu = solve_linear([&](const Points& x) { return drift.transposed(q, x); },
                                 [&]() -> Eigen::MatrixXd { return drift.jacobian(q).transpose(); },
                                 end_bar.q - half * kernel.hessian(q, p, end_bar.p));
  const Points p_bar =
      end_bar.p + half * (kernel.apply(q, q, mu) + kernel.apply(q0, q0, mu) - kernel.apply_tangent(q, p, end_bar.p));
  const Points nu = solve_linear([&](const Points& x) { return kick.transposed(p, x); },
                                 [&]() -> Eigen::MatrixXd { return kick.jacobian(p).transpose(); }, p_bar);
  return {{mu + half * (kernel.gradient(q0, mu, p) - kernel.hessian(q0, p, nu)), nu},
          VectorXd::Zero(step.w.size()),
          VectorXd::Zero(step.system.noise->parameters().size())};
}

SpaceStep StormerVerletIntegrator::do_space(const Step& step) const {
  SpaceStep space;
  space.stages = {{step.start.q, step.momenta}, {step.end.q, step.momenta}};
  const double half = step.dt / 2;
  space.drift = (Eigen::Matrix<double, 3, 2>() << 0, 0, half, half, half, half).finished();
  space.noise = Eigen::MatrixXd::Zero(3, 2);
  return space;
}

}  // namespace pulson
