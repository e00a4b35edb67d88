#include "step_field.hpp"

#include "implicit_step.hpp"

namespace pulson {
namespace {

PhaseState zero(const PhaseState& z) {
  return {Points::Zero(z.q.rows(), z.q.cols()), Points::Zero(z.q.rows(), z.q.cols())};
}

}  // namespace

PhaseState operator+(const PhaseState& a, const PhaseState& b) { return {a.q + b.q, a.p + b.p}; }
PhaseState operator*(double factor, const PhaseState& a) { return {factor * a.q, factor * a.p}; }

PhaseState StepField::value(const PhaseState& z) const {
  PhaseState f = zero(z);
  if (dt_ != 0) {
    const Points velocity = hamiltonian_p(system_.kernel, z.q, z.p);
    f = {dt_ * velocity, -dt_ * hamiltonian_q(system_.kernel, z.q, z.p) - dt_ * system_.noise->friction() * velocity};
  }
  if (!has_noise()) return f;
  const PhaseState h = system_.noise->gradient(z, w_);
  return {f.q + h.p, f.p - h.q};
}

PhaseState StepField::tangent(const PhaseState& z, const PhaseState& delta) const {
  const KernelOperator& kernel = system_.kernel;
  PhaseState f = zero(z);
  if (dt_ != 0) {
    const Points velocity = kernel.apply_tangent(z.q, z.p, delta.q) + kernel.apply(z.q, z.q, delta.p);
    const Points force = kernel.hessian(z.q, z.p, delta.q) + kernel.gradient(z.q, delta.p, z.p);
    f = {dt_ * velocity, -dt_ * force - dt_ * system_.noise->friction() * velocity};
  }
  if (!has_noise()) return f;
  const PhaseState h = system_.noise->hessian(z, w_, delta);
  return {f.q + h.p, f.p - h.q};
}

PhaseState StepField::transposed(const PhaseState& z, const PhaseState& mu) const {
  const KernelOperator& kernel = system_.kernel;
  PhaseState f = zero(z);
  if (dt_ != 0) {
    const Points v = mu.q - system_.noise->friction() * mu.p;
    f = {dt_ * (kernel.gradient(z.q, v, z.p) - kernel.hessian(z.q, z.p, mu.p)),
         dt_ * (kernel.apply(z.q, z.q, v) - kernel.apply_tangent(z.q, z.p, mu.p))};
  }
  if (!has_noise()) return f;
  return f + system_.noise->hessian(z, w_, {-mu.p, mu.q});
}

PhaseState StepField::forced(const PhaseState& z, const Eigen::VectorXd& w_change,
                             const Eigen::VectorXd& parameters) const {
  const NoiseModel& noise = *system_.noise;
  if (!has_noise()) return zero(z);
  PhaseState h = noise.gradient(z, w_change);
  if (parameters.size() == 0) return {h.p, -h.q};
  h = h + noise.gradient_by_parameters(z, w_, parameters);
  const double friction = dt_ * noise.friction_by_parameters(parameters);
  if (friction != 0) h.q += friction * hamiltonian_p(system_.kernel, z.q, z.p);
  return {h.p, -h.q};
}

void StepField::add_forced_transposed(const PhaseState& z, const PhaseState& mu, Eigen::VectorXd& w_bar,
                                      Eigen::VectorXd& parameters_bar) const {
  if (!has_noise()) return;
  w_bar += system_.noise->contract(z, {-mu.p, mu.q});
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(w_.size());
  for (Eigen::Index i = 0; i < parameters_bar.size(); ++i) {
    const PhaseState f = forced(z, none, Eigen::VectorXd::Unit(parameters_bar.size(), i));
    parameters_bar[i] += inner_product(mu.q, f.q) + inner_product(mu.p, f.p);
  }
}

}  // namespace pulson
