#include <Eigen/LU>

#include "pulson/core/parallel.hpp"
#include "variational_parts.hpp"

namespace pulson {

namespace {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A Hessian's blocks as dN×dN matrices; pq = qpᵀ, and pp is 0 for what is affine in p.
struct DenseHessian {
  MatrixXd qq;
  MatrixXd pq;
};

template <class Product>
MatrixXd dense_pp(const Product& product, Index rows, Index cols) {
  const Points zero = Points::Zero(rows, cols);
  return matrix_of([&](const Points& dp) { return product(PhaseState{zero, dp}).p; }, rows, cols);
}

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

// to += (K ⊗ I) from, an axis at a time.
void RowSweep::add_velocities(const MatrixXd& gram, const MatrixXd& from, MatrixXd& to) const {
  using Rows = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  const Rows of_axis(d_ * n_, d_);
  for (Index axis = 0; axis < d_; ++axis) {
    const MatrixXd part = Eigen::Map<const MatrixXd, 0, Rows>(from.data() + axis, n_, from.cols(), of_axis);
    Eigen::Map<MatrixXd, 0, Rows>(to.data() + axis, n_, to.cols(), of_axis) += (gram * part).eval();
  }
}

void RowSweep::through_flow(const Points& q, const Points& p) {
  StepMatrices step = system_.kernel.step_matrices(q, p, dt_);
  MatrixXd& tangent = step.tangent;
  MatrixXd& hessian = step.hessian;
  MatrixXd of_friction, by_momenta;
  if (!traits_.hamiltonian) {  // friction acts on K(q)p alone, and not on what compensates
    q_bar_.noalias() -= noise_.friction() * tangent.transpose() * p_bar_;
    of_friction = MatrixXd::Zero(p_bar_.rows(), p_bar_.cols());
    add_velocities(noise_.friction() * step.gram, p_bar_, of_friction);
  }
  if (compensates_) {
    const auto product = [&](const PhaseState& unit) { return noise_.compensation_hessian({q, p}, unit); };
    const DenseHessian of_g = dense_hessian(product, d_, n_, traits_.local);
    tangent += dt_ * of_g.pq;
    hessian += dt_ * of_g.qq;
    if (!traits_.affine) by_momenta = dt_ * dense_pp(product, d_, n_);
  }
  q_bar_.noalias() -= hessian * p_bar_;
  p_bar_ -= (tangent * p_bar_).eval();
  if (!traits_.hamiltonian) p_bar_ -= of_friction;
  q_bar_ = (one_ - tangent.transpose()).partialPivLu().solve(q_bar_).eval();
  add_velocities(step.gram, q_bar_, p_bar_);
  if (by_momenta.size() > 0) p_bar_ += by_momenta * q_bar_;
}

void RowSweep::through_noise(const PhaseState& inside, const VectorXd& w, Eigen::Ref<MatrixXd> by_w) {
  const MatrixXd mu = q_bar_;
  if (!traits_.additive) {
    const auto product = [&](const PhaseState& unit) { return noise_.hessian(inside, w, unit); };
    const DenseHessian of_h = dense_hessian(product, d_, n_, traits_.local);
    if (traits_.moves_positions()) q_bar_.noalias() += of_h.pq.transpose() * mu;
    if (traits_.moves_momenta) {
      p_bar_ = (one_ + of_h.pq).partialPivLu().solve(p_bar_).eval();
      q_bar_.noalias() -= of_h.qq * p_bar_;
    }
  }
  rows_by_noise(inside, mu, p_bar_, by_w);
}

void RowSweep::through_adjoint_flow(const Points& q, const Points& p) {
  StepMatrices step = system_.kernel.step_matrices(q, p, dt_);
  const MatrixXd& tangent = step.tangent;
  MatrixXd& hessian = step.hessian;
  MatrixXd implicit = one_ + tangent;
  if (!traits_.hamiltonian) {
    implicit += noise_.friction() * velocity_matrix(step.gram, d_);
    hessian += noise_.friction() * tangent.transpose();
  }
  add_velocities(step.gram, q_bar_, p_bar_);
  p_bar_ = implicit.partialPivLu().solve(p_bar_).eval();
  q_bar_ += (tangent.transpose() * q_bar_).eval();
  q_bar_.noalias() -= hessian * p_bar_;
}

RowSweep::Adjoints RowSweep::field_transposed(const PhaseState& z, const Adjoints& mu, const VectorXd& w) const {
  const StepMatrices step = system_.kernel.step_matrices(z.q, z.p, dt_);
  MatrixXd pushed = mu.q;
  if (!traits_.hamiltonian) pushed -= noise_.friction() * mu.p;
  Adjoints rows{step.tangent.transpose() * pushed, -step.tangent * mu.p};
  rows.q.noalias() -= step.hessian * mu.p;
  add_velocities(step.gram, pushed, rows.p);
  if (traits_.additive || w.size() == 0) return rows;
  const auto product = [&](const PhaseState& unit) { return noise_.hessian(z, w, unit); };
  const DenseHessian of_h = dense_hessian(product, d_, n_, traits_.local);
  if (traits_.moves_positions()) rows.q.noalias() += of_h.pq.transpose() * mu.q;
  if (traits_.moves_momenta) {
    rows.q.noalias() -= of_h.qq * mu.p;
    rows.p.noalias() -= of_h.pq * mu.p;
  }
  return rows;
}

void RowSweep::through_stages(const ExplicitTableau& tableau, const std::vector<PhaseState>& stages, const VectorXd& w,
                              Eigen::Ref<MatrixXd> by_w) {
  const Adjoints end{q_bar_, p_bar_};
  std::vector<Adjoints> at(stages.size());
  MatrixXd of_stage(by_w.rows(), by_w.cols());
  by_w.setZero();
  for (std::size_t i = stages.size(); i-- > 0;) {
    const double share = tableau.b[static_cast<Index>(i)];
    Adjoints mu{share * end.q, share * end.p};
    for (std::size_t later = i + 1; later < stages.size(); ++later)
      if (const double a = tableau.a(static_cast<Index>(later), static_cast<Index>(i)); a != 0) {
        mu.q += a * at[later].q;
        mu.p += a * at[later].p;
      }
    at[i] = field_transposed(stages[i], mu, w);
    rows_by_noise(stages[i], mu.q, mu.p, of_stage);
    by_w += of_stage;
    q_bar_ += at[i].q;
    p_bar_ += at[i].p;
  }
}

// With A = ∇²h_w,pq and B = ∇²h_w,qq at m: (I + ½A)ν_p = 2p̄⁺, (I − ½Aᵀ)ν_q = 2q̄⁺ − ½Bν_p, and (q̄, p̄) = ν − (q̄⁺, p̄⁺).
void RowSweep::through_midpoint_noise(const PhaseState& middle, const VectorXd& w, Eigen::Ref<MatrixXd> by_w) {
  if (traits_.additive) return rows_by_noise(middle, q_bar_, p_bar_, by_w);
  const auto product = [&](const PhaseState& unit) { return noise_.hessian(middle, w, unit); };
  const DenseHessian of_h = dense_hessian(product, d_, n_, traits_.local);
  const bool mixed = traits_.moves_positions() && traits_.moves_momenta;  // else A = 0
  MatrixXd nu_p = 2 * p_bar_;
  if (mixed) nu_p = (one_ + 0.5 * of_h.pq).partialPivLu().solve(nu_p).eval();
  MatrixXd nu_q = 2 * q_bar_ - 0.5 * of_h.qq * nu_p;
  if (mixed) nu_q = (one_ - 0.5 * of_h.pq.transpose()).partialPivLu().solve(nu_q).eval();
  rows_by_noise(middle, 0.5 * nu_q, 0.5 * nu_p, by_w);
  q_bar_ = nu_q - q_bar_;
  p_bar_ = nu_p - p_bar_;
}

RowSweep::Fields RowSweep::fields(const PhaseState& at, Index channels) const {
  Fields fields{MatrixXd(d_ * n_, channels), MatrixXd(d_ * n_, channels)};
  VectorXd w = VectorXd::Zero(channels);
  for (Index i = 0; i < channels; ++i) {
    w[i] = 1;
    const PhaseState field = noise_.gradient(at, w);
    w[i] = 0;
    fields.q.col(i) = field.q.reshaped();
    fields.p.col(i) = field.p.reshaped();
  }
  return fields;
}

// ∇h_i·(−ν, μ) for each row and channel i. Constant fields are taken once; most move one landmark each.
void RowSweep::rows_by_noise(const PhaseState& at, const MatrixXd& mu, const MatrixXd& nu, Eigen::Ref<MatrixXd> by_w) {
  if (by_w.cols() == 0) return;
  if (traits_.additive) {
    if (constant_p_.cols() == 0) {
      const Fields constant = fields(at, by_w.cols());
      constant_q_ = constant.q.sparseView();
      constant_p_ = constant.p.sparseView();
    }
    by_w.setZero();
    if (traits_.moves_positions()) by_w += mu.transpose() * constant_p_;
    if (traits_.moves_momenta) by_w -= nu.transpose() * constant_q_;
    return;
  }
  const Fields here = fields(at, by_w.cols());
  by_w.noalias() = mu.transpose() * here.p;
  if (traits_.moves_momenta) by_w.noalias() -= nu.transpose() * here.q;
}

namespace {
using Indices = std::vector<Index>;

constexpr Index kCarriedAtOnce = 64;
constexpr Index kColumnsAtOnce = 64;

// Rows a·d + axis of the landmarks given, axis by axis: index axis·M + a.
Indices rows_of(const Indices& landmarks, Index d) {
  Indices rows;
  for (Index axis = 0; axis < d; ++axis)
    for (const Index a : landmarks) rows.push_back(a * d + axis);
  return rows;
}

void for_blocks(Index count, Index size, const std::function<void(Index first, Index size)>& task) {
  parallel_for(static_cast<int>((count + size - 1) / size), [&](int block) {
    const Index first = block * size;
    task(first, std::min(size, count - first));
  });
}

template <int d>
class ChangesSweep {
 public:
  ChangesSweep(const KernelOperator& kernel, Indices moving, Indices carried, const MatrixXd& changes)
      : kernel_(kernel),
        moving_(std::move(moving)),
        carried_(std::move(carried)),
        dp_(changes(rows_of(moving_, d), Eigen::all)),
        dq_(MatrixXd::Zero(dp_.rows(), dp_.cols())),
        dx_(MatrixXd::Zero(d * count(carried_), dp_.cols())) {}

  void advance(const FlowSegment& segment) {
    const Moving at{segment.q(Eigen::all, moving_), segment.p(Eigen::all, moving_)};
    const StepMatrices step = kernel_.step_matrices(at.q, at.p, segment.dt, CoordinateOrder::kByAxis);
    if (segment.adjoint)
      advance_by_adjoint(segment, at, step);
    else
      advance_by_flow(segment, at, step);
  }

  MatrixXd changes() const {
    MatrixXd all(dx_.rows() + dq_.rows(), dq_.cols());
    all(rows_of(moving_, d), Eigen::all) = dq_;
    for (Index i = 0; i < count(carried_); ++i)
      all.template middleRows<d>(carried_[static_cast<std::size_t>(i)] * d) = dx_.template middleRows<d>(i * d);
    return all;
  }

 private:
  using Vector = Eigen::Matrix<double, d, 1>;
  using Block = Eigen::Matrix<double, d, d>;

  using Moving = PhaseState;  // (q, p) of the landmarks that move

  // δq⁺ = (I − ΔtA)⁻¹(δq + ΔtK δp), δp⁺ = δp − ΔtAᵀδp − ΔtH_qq δq⁺. The carried need δp too, so forces come last.
  void advance_by_flow(const FlowSegment& segment, const Moving& at, const StepMatrices& step) {
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(dp_.rows(), dp_.rows()) - step.tangent);
    for_blocks(dq_.cols(), kColumnsAtOnce, [&](Index first, Index size) {
      auto dq = dq_.middleCols(first, size);
      add_velocities(step, first, dq);
      dq = lu.solve(dq).eval();
    });
    carry(segment, at);
    for_blocks(dq_.cols(), kColumnsAtOnce, [&](Index first, Index size) {
      auto dp = dp_.middleCols(first, size);
      dp -= (step.tangent.transpose() * dp).eval();
      dp.noalias() -= step.hessian * dq_.middleCols(first, size);
    });
  }

  // δp' = (I + ΔtAᵀ)⁻¹(δp − ΔtH_qq δq), δq' = δq + ΔtAδq + ΔtK δp'. The carried need δq too, so velocities come last.
  void advance_by_adjoint(const FlowSegment& segment, const Moving& at, const StepMatrices& step) {
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(dp_.rows(), dp_.rows()) + step.tangent.transpose());
    for_blocks(dq_.cols(), kColumnsAtOnce, [&](Index first, Index size) {
      auto dp = dp_.middleCols(first, size);
      dp.noalias() -= step.hessian * dq_.middleCols(first, size);
      dp = lu.solve(dp).eval();
    });
    carry(segment, at);
    for_blocks(dq_.cols(), kColumnsAtOnce, [&](Index first, Index size) {
      auto dq = dq_.middleCols(first, size);
      dq += (step.tangent * dq).eval();
      add_velocities(step, first, dq);
    });
  }

  // δq += ΔtK δp
  template <class Columns>
  void add_velocities(const StepMatrices& step, Index first, Columns& dq) const {
    const Index m = count(moving_);
    for (int axis = 0; axis < d; ++axis)
      dq.middleRows(axis * m, m).noalias() += step.gram * dp_.block(axis * m, first, m, dq.cols());
  }

  static Index count(const Indices& landmarks) { return static_cast<Index>(landmarks.size()); }

  // With v = δx + Δt Σ_j (K δp_j − p_j ∇K·δq_j): δx⁺ = (I − Δt∇u)⁻¹ v where the part ends, v + Δt∇u δx where it begins.
  void carry(const FlowSegment& segment, const Moving& moving) {
    const Index m = count(moving_);
    for_blocks(count(carried_), kCarriedAtOnce, [&](Index first, Index size) {
      MatrixXd gram(size, m);
      MatrixXd by_q(d * size, d * m);  // rows axis by axis
      std::vector<Block> slopes(static_cast<std::size_t>(size), Block::Zero());
      for (Index j = 0; j < m; ++j) {
        for (Index i = 0; i < size; ++i) {
          const Vector z = segment.q.col(carried_[static_cast<std::size_t>(first + i)]) - moving.q.col(j);
          const RadialJet k = kernel_.jet(z.squaredNorm());
          const Block slope = segment.dt * Vector(moving.p.col(j)) * (k.first * z).transpose();
          slopes[static_cast<std::size_t>(i)] += slope;
          gram(i, j) = segment.dt * k.value;
          for (int c = 0; c < d; ++c)
            for (int r = 0; r < d; ++r) by_q(r * size + i, c * m + j) = -slope(r, c);
        }
      }
      MatrixXd moved = by_q * dq_;
      for (int axis = 0; axis < d; ++axis)
        moved.middleRows(axis * size, size).noalias() += gram * dp_.middleRows(axis * m, m);
      for (Index i = 0; i < size; ++i) {
        auto rows = dx_.template middleRows<d>((first + i) * d);
        const Block& slope = slopes[static_cast<std::size_t>(i)];
        if (segment.adjoint) rows += (slope * rows).eval();
        for (int axis = 0; axis < d; ++axis) rows.row(axis) += moved.row(axis * size + i);
        if (!segment.adjoint) rows = (Block(Block::Identity() - slope).inverse() * rows).eval();
      }
    });
  }

  const KernelOperator& kernel_;
  Indices moving_;
  Indices carried_;
  MatrixXd dp_;  // of those that move, index axis·M + a
  MatrixXd dq_;
  MatrixXd dx_;  // of those that are carried, index a·d + axis
};

template <int d>
MatrixXd changes_in(const KernelOperator& kernel, const std::vector<FlowSegment>& segments, Indices moving,
                    Indices carried, const MatrixXd& momentum_changes) {
  ChangesSweep<d> sweep(kernel, std::move(moving), std::move(carried), momentum_changes);
  for (const FlowSegment& segment : segments) sweep.advance(segment);
  return sweep.changes();
}

}  // namespace

bool changes_need_no_noise(const NoiseTraits& traits) {
  return traits.additive && !traits.moves_momenta && traits.hamiltonian && !traits.compensated;
}

bool rows_cost_less(const Trajectory& path, const MatrixXd& momentum_changes) {
  return 10 * momentum_changes.cols() > path.initial().q.size();
}

MatrixXd changes_along(const KernelOperator& kernel, const Points& p0, const std::vector<FlowSegment>& segments,
                       const MatrixXd& momentum_changes) {
  const Index d = p0.rows();
  Indices moving, carried;
  for (Index a = 0; a < p0.cols(); ++a) {
    const bool moves = (p0.col(a).array() != 0).any() || (momentum_changes.middleRows(a * d, d).array() != 0).any();
    (moves ? moving : carried).push_back(a);
  }
  switch (d) {
    case 1:
      return changes_in<1>(kernel, segments, std::move(moving), std::move(carried), momentum_changes);
    case 2:
      return changes_in<2>(kernel, segments, std::move(moving), std::move(carried), momentum_changes);
    default:
      return changes_in<3>(kernel, segments, std::move(moving), std::move(carried), momentum_changes);
  }
}

}  // namespace pulson
