#include "variational_parts.hpp"

namespace pulson {

using Eigen::Index;
using Eigen::MatrixXd;

Points PositionMap::value(const Points& q) const {
  Points velocity = hamiltonian_p(system_.kernel, q, p_);
  if (compensates_) velocity += system_.noise->compensation_gradient({q, p_}).p;
  return dt_ * velocity;
}

Points PositionMap::tangent(const Points& q, const Points& delta) const {
  Points change = system_.kernel.apply_tangent(q, p_, delta);
  if (compensates_) change += system_.noise->compensation_hessian({q, p_}, {delta, Points::Zero(q.rows(), q.cols())}).p;
  return dt_ * change;
}

Points PositionMap::transposed(const Points& q, const Points& mu) const {
  Points change = system_.kernel.gradient(q, mu, p_);
  if (compensates_) change += system_.noise->compensation_hessian({q, p_}, {Points::Zero(q.rows(), q.cols()), mu}).q;
  return dt_ * change;
}

MatrixXd PositionMap::jacobian(const Points& q) const {
  MatrixXd matrix = dt_ * system_.kernel.step_matrices(q, p_, 1).tangent;
  if (compensates_) {
    const Points zero = Points::Zero(q.rows(), q.cols());
    matrix += dt_ * matrix_of(
                        [&](const Points& delta) {
                          return system_.noise->compensation_hessian({q, p_}, {delta, zero}).p;
                        },
                        q.rows(), q.cols());
  }
  return matrix;
}

Eigen::VectorXd PositionMap::rounding_scale() const {
  return Eigen::VectorXd::Constant(1, dt_ * system_.kernel.at_zero() * p_.colwise().norm().sum());
}

bool PositionMap::on_same_branch(const Points& before, const Points& after) const {
  if (compensates_ && !system_.noise->traits().affine) return true;  // landmarks may pass each other
  const auto none_turned = [&](Index b, Index first, Index count) {
    const auto from = before.middleCols(first, count).colwise() - before.col(b);
    const auto to = after.middleCols(first, count).colwise() - after.col(b);
    return ((from.array() * to.array()).colwise().sum() >= 0).all();
  };
  const Eigen::Array<bool, 1, Eigen::Dynamic> moving = (p_.array() != 0).colwise().any();
  const bool all_moving = moving.all();
  const Index count = before.cols();
  for (Index b = 0; b < count; ++b)
    if (moving[b] && !(none_turned(b, 0, b) && (all_moving || none_turned(b, b + 1, count - b - 1)))) return false;
  return true;
}

Points KickMap::value(const Points& p) const {
  Points force = -dt_ * hamiltonian_q(system_.kernel, q_, p);
  if (friction() > 0) force -= dt_ * friction() * hamiltonian_p(system_.kernel, q_, p);
  return force;
}

Points KickMap::tangent(const Points& p, const Points& delta) const {
  Points change = -dt_ * system_.kernel.gradient(q_, delta, p);
  if (friction() > 0) change -= dt_ * friction() * system_.kernel.apply(q_, q_, delta);
  return change;
}

Points KickMap::transposed(const Points& p, const Points& mu) const {
  Points change = -dt_ * system_.kernel.apply_tangent(q_, p, mu);
  if (friction() > 0) change -= dt_ * friction() * system_.kernel.apply(q_, q_, mu);
  return change;
}

MatrixXd KickMap::jacobian(const Points& p) const {
  MatrixXd matrix = -dt_ * system_.kernel.step_matrices(q_, p, 1).tangent.transpose();
  if (friction() > 0) matrix -= dt_ * friction() * velocity_matrix(system_.kernel.gram(q_, q_), q_.rows());
  return matrix;
}

Eigen::VectorXd KickMap::rounding_scale() const {
  const double total = momenta_.colwise().norm().sum();
  const KernelOperator& kernel = system_.kernel;
  return Eigen::VectorXd::Constant(1, dt_ * total * (kernel.lipschitz() * total + friction() * kernel.at_zero()));
}

MatrixXd MomentumMap::jacobian(const Points& p) const {
  const Points zero = Points::Zero(p.rows(), p.cols());
  return matrix_of(
      [&](const Points& delta) -> Points {
        return -noise_.hessian({q_, p}, w_, {zero, delta}).q;
      },
      p.rows(), p.cols());
}

MatrixXd velocity_matrix(const MatrixXd& gram, Index dimension) {
  MatrixXd matrix = MatrixXd::Zero(dimension * gram.rows(), dimension * gram.cols());
  for (Index b = 0; b < gram.cols(); ++b)
    for (Index a = 0; a < gram.rows(); ++a)
      matrix.block(a * dimension, b * dimension, dimension, dimension).diagonal().setConstant(gram(a, b));
  return matrix;
}

namespace {
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
  const Points zero = Points::Zero(q.rows(), q.cols());
  PhaseState of_g;
  if (compensates_ && by_parameters) of_g = noise.compensation_by_parameters(at, parameters);
  Points dq = change.q + dt_ * kernel.apply(q, q, change.p);
  if (bends_in_momenta()) dq += dt_ * noise.compensation_hessian(at, {zero, change.p}).p;
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
  if (bends_in_momenta()) p_bar += dt_ * noise.compensation_hessian(at, {Points::Zero(q.rows(), q.cols()), mu}).p;
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
