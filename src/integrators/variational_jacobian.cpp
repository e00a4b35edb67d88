#include <Eigen/LU>

#include "pulson/integrators/variational.hpp"
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

// The adjoint of all coordinates r of q(T) at once, as do_adjoint: column r of q_bar and p_bar is the adjoint state of
// r.
class RowSweep {
 public:
  RowSweep(const StochasticSystem& system, double dt, bool compensates, Index d, Index n)
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

  const MatrixXd& p_bar() const { return p_bar_; }

  // From (q⁺, p̂⁺) back to (q̃, p) where q̃ = q + h_p w: q_bar is μ then.
  void through_flow(const Points& q, const Points& p) {
    MatrixXd tangent = dt_ * system_.kernel.tangent_matrix(q, p);
    MatrixXd hessian = dt_ * system_.kernel.hessian_matrix(q, p);
    const MatrixXd velocity = dt_ * velocity_matrix(system_.kernel, q);
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

  // On to (q, p̂), and the rows' derivatives by w. @param inside (q, p)
  void through_noise(const PhaseState& inside, const VectorXd& w, Eigen::Ref<MatrixXd> by_w) {
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
    if (by_w.cols() > 0) rows_by_noise(inside, mu, by_w);
  }

 private:
  // ∇h_i·(−p̄, μ) for each row and channel i: row by row where fields are constant and so cheap, else all at once.
  void rows_by_noise(const PhaseState& inside, const MatrixXd& mu, Eigen::Ref<MatrixXd> by_w) const {
    if (traits_.additive) {
      for (Index r = 0; r < by_w.rows(); ++r) {
        PhaseState with{Points::Zero(d_, n_), mu.col(r).reshaped(d_, n_)};
        if (traits_.moves_momenta) with.q = -p_bar_.col(r).reshaped(d_, n_);
        by_w.row(r) = noise_.contract(inside, with).transpose();
      }
      return;
    }
    MatrixXd of_q(d_ * n_, by_w.cols());
    MatrixXd of_p(d_ * n_, by_w.cols());
    for (Index i = 0; i < by_w.cols(); ++i) {
      const PhaseState field = noise_.gradient(inside, VectorXd::Unit(by_w.cols(), i));
      of_q.col(i) = field.q.reshaped();
      of_p.col(i) = field.p.reshaped();
    }
    by_w.noalias() = mu.transpose() * of_p;
    if (traits_.moves_momenta) by_w.noalias() -= p_bar_.transpose() * of_q;
  }

  const StochasticSystem& system_;
  const NoiseModel& noise_;
  NoiseTraits traits_;
  double dt_;
  bool compensates_;
  Index d_;
  Index n_;
  MatrixXd one_;
  MatrixXd q_bar_;
  MatrixXd p_bar_;
};

}  // namespace

EndpointJacobian VariationalIntegrator::endpoint_jacobian(const StochasticSystem& system,
                                                          const Trajectory& path) const {
  const Points& q0 = path.initial().q;
  const Index channels = path.increments.rows();
  const MatrixXd w = acting_increments(path.increments);
  RowSweep sweep(system, path.grid.dt(), compensates(*system.noise), q0.rows(), q0.cols());
  MatrixXd by_w(q0.size(), channels * path.grid.steps);
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const Step step = step_of(system, path, k, w);
    sweep.through_flow(step.end.q, step.momenta);
    sweep.through_noise({step.start.q, step.momenta}, step.w, by_w.middleCols(k * channels, channels));
  }
  EndpointJacobian jacobian{sweep.p_bar().transpose(), 0.5 * by_w};
  const Index later = channels * (path.grid.steps - 1);
  jacobian.increments.leftCols(later) += 0.5 * by_w.rightCols(later);
  return jacobian;
}

}  // namespace pulson
