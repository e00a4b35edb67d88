#include "row_sweep.hpp"

#include <Eigen/LU>

#include "variational_maps.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A Hessian's blocks as dN×dN matrices; pq = qpᵀ, and pp = 0 for what is affine in p.
struct DenseHessian {
  MatrixXd qq;
  MatrixXd pq;
};

template <class Product>
DenseHessian dense_hessian(const Product& product, Index rows, Index cols, bool local) {
  DenseHessian dense{MatrixXd::Zero(rows * cols, rows * cols), MatrixXd::Zero(rows * cols, rows * cols)};
  PhaseState unit{Points::Zero(rows, cols), Points::Zero(rows, cols)};
  for (Index axis = 0; local && axis < rows; ++axis) {  // one product for all landmarks, which do not see each other
    unit.q.row(axis).setOnes();
    const PhaseState columns = product(unit);
    for (Index a = 0; a < cols; ++a) {
      dense.qq.block(a * rows, a * rows + axis, rows, 1) = columns.q.col(a);
      dense.pq.block(a * rows, a * rows + axis, rows, 1) = columns.p.col(a);
    }
    unit.q.row(axis).setZero();
  }
  if (local) return dense;
  for (Index i = 0; i < unit.q.size(); ++i) {
    unit.q.reshaped()[i] = 1;
    const PhaseState column = product(unit);
    dense.qq.col(i) = column.q.reshaped();
    dense.pq.col(i) = column.p.reshaped();
    unit.q.reshaped()[i] = 0;
  }
  return dense;
}

}  // namespace

RowSweep::RowSweep(const StochasticSystem& system, double dt, bool compensates, Index d, Index n)
    : system_(system),
      noise_(*system.noise),
      traits_(system.noise->traits()),
      dt_(dt),
      compensates_(compensates),
      d_(d),
      n_(n),
      one_(MatrixXd::Identity(d * n, d * n)),
      q_bar_(one_),
      p_bar_(MatrixXd::Zero(d * n, d * n)) {}

void RowSweep::through_flow(const Points& q, const Points& p) {
  const StepMatrices per_time = system_.kernel.step_matrices(q, p, 1);
  MatrixXd tangent = dt_ * per_time.tangent;
  MatrixXd hessian = dt_ * per_time.hessian;
  const MatrixXd velocity = dt_ * velocity_matrix(system_.kernel.gram(q, q), d_);
  MatrixXd of_friction;
  if (!traits_.hamiltonian) {  // friction acts on K(q)p alone, and not on what compensates
    q_bar_.noalias() -= noise_.friction() * tangent.transpose() * p_bar_;
    of_friction = noise_.friction() * velocity * p_bar_;
  }
  if (compensates_) {
    const auto product = [&](const PhaseState& unit) { return noise_.compensation_hessian({q, p}, unit); };
    const DenseHessian of_g = dense_hessian(product, d_, n_, traits_.local);
    tangent += dt_ * of_g.pq;
    hessian += dt_ * of_g.qq;
  }
  q_bar_.noalias() -= hessian * p_bar_;
  p_bar_ -= (tangent * p_bar_).eval();
  if (!traits_.hamiltonian) p_bar_ -= of_friction;
  q_bar_ = (one_ - tangent.transpose()).partialPivLu().solve(q_bar_).eval();
  p_bar_.noalias() += velocity * q_bar_;
}

void RowSweep::through_noise(const PhaseState& inside, const VectorXd& w, Eigen::Ref<MatrixXd> by_w) {
  const MatrixXd mu = q_bar_;
  if (!traits_.additive) {
    const auto product = [&](const PhaseState& unit) { return noise_.hessian(inside, w, unit); };
    const DenseHessian of_h = dense_hessian(product, d_, n_, traits_.local);
    if (traits_.moves_positions) q_bar_.noalias() += of_h.pq.transpose() * mu;
    if (traits_.moves_momenta) {
      p_bar_ = (one_ + of_h.pq).partialPivLu().solve(p_bar_).eval();
      q_bar_.noalias() -= of_h.qq * p_bar_;
    }
  }
  rows_by_noise(inside, mu, p_bar_, by_w);
}

void RowSweep::through_adjoint_flow(const Points& q, const Points& p) {
  const StepMatrices per_time = system_.kernel.step_matrices(q, p, 1);
  MatrixXd tangent = dt_ * per_time.tangent;
  MatrixXd hessian = dt_ * per_time.hessian;
  const MatrixXd velocity = dt_ * velocity_matrix(system_.kernel.gram(q, q), d_);
  MatrixXd implicit = one_ + tangent;
  if (!traits_.hamiltonian) {
    implicit += noise_.friction() * velocity;
    hessian += noise_.friction() * tangent.transpose();
  }
  p_bar_.noalias() += velocity * q_bar_;
  p_bar_ = implicit.partialPivLu().solve(p_bar_).eval();
  q_bar_ += (tangent.transpose() * q_bar_).eval();
  q_bar_.noalias() -= hessian * p_bar_;
}

// With A = ∇²h_w,pq and B = ∇²h_w,qq at m: (I + ½A)ν_p = 2p̄⁺, (I − ½Aᵀ)ν_q = 2q̄⁺ − ½Bν_p, and (q̄, p̄) = ν − (q̄⁺, p̄⁺).
void RowSweep::through_midpoint_noise(const PhaseState& middle, const VectorXd& w, Eigen::Ref<MatrixXd> by_w) {
  if (traits_.additive) return rows_by_noise(middle, q_bar_, p_bar_, by_w);
  const auto product = [&](const PhaseState& unit) { return noise_.hessian(middle, w, unit); };
  const DenseHessian of_h = dense_hessian(product, d_, n_, traits_.local);
  const bool mixed = traits_.moves_positions && traits_.moves_momenta;  // else A = 0
  MatrixXd nu_p = 2 * p_bar_;
  if (mixed) nu_p = (one_ + 0.5 * of_h.pq).partialPivLu().solve(nu_p).eval();
  MatrixXd nu_q = 2 * q_bar_ - 0.5 * of_h.qq * nu_p;
  if (mixed) nu_q = (one_ - 0.5 * of_h.pq.transpose()).partialPivLu().solve(nu_q).eval();
  rows_by_noise(middle, 0.5 * nu_q, 0.5 * nu_p, by_w);
  q_bar_ = nu_q - q_bar_;
  p_bar_ = nu_p - p_bar_;
}

// ∇h_i·(−ν, μ) for each row and channel i: row by row where fields are constant and so inexpensive, else all at once.
void RowSweep::rows_by_noise(const PhaseState& at, const MatrixXd& mu, const MatrixXd& nu,
                             Eigen::Ref<MatrixXd> by_w) const {
  if (by_w.cols() == 0) return;
  if (traits_.additive) {
    for (Index r = 0; r < by_w.rows(); ++r) {
      PhaseState with{Points::Zero(d_, n_), mu.col(r).reshaped(d_, n_)};
      if (traits_.moves_momenta) with.q = -nu.col(r).reshaped(d_, n_);
      by_w.row(r) = noise_.contract(at, with).transpose();
    }
    return;
  }
  MatrixXd of_q(d_ * n_, by_w.cols());
  MatrixXd of_p(d_ * n_, by_w.cols());
  for (Index i = 0; i < by_w.cols(); ++i) {
    const PhaseState field = noise_.gradient(at, VectorXd::Unit(by_w.cols(), i));
    of_q.col(i) = field.q.reshaped();
    of_p.col(i) = field.p.reshaped();
  }
  by_w.noalias() = mu.transpose() * of_p;
  if (traits_.moves_momenta) by_w.noalias() -= nu.transpose() * of_q;
}

}  // namespace pulson
