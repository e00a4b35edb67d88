#include "variational_maps.hpp"

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

}  // namespace pulson
