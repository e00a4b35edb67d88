#include "pulson/integrators/variational.hpp"

#include <algorithm>
#include <cassert>

#include <Eigen/LU>

#include "implicit_step.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// K ⊗ I as a dN×dN matrix.
MatrixXd velocity_matrix(const KernelOperator& kernel, const Points& q) {
  const Index d = q.rows();
  const MatrixXd gram = kernel.gram(q, q);
  MatrixXd matrix = MatrixXd::Zero(d * q.cols(), d * q.cols());
  for (Index axis = 0; axis < d; ++axis)
    for (Index b = 0; b < q.cols(); ++b)
      for (Index a = 0; a < q.cols(); ++a) matrix(a * d + axis, b * d + axis) = gram(a, b);
  return matrix;
}

}  // namespace

Trajectory VariationalIntegrator::integrate(const StochasticSystem& system, const PhaseState& initial,
                                            const TimeGrid& grid, const MatrixXd& increments, RootSearch search) const {
  assert(increments.cols() == grid.steps);
  const MatrixXd w = acting_increments(increments);
  Trajectory path;
  path.grid = grid;
  path.states.reserve(static_cast<std::size_t>(grid.steps) + 1);
  path.states.push_back(initial);
  for (int k = 0; k < grid.steps; ++k) {
    const PhaseState& state = path.states.back();
    path.contraction_bound = std::max(path.contraction_bound, contraction_bound(system.kernel, state.p, grid.dt()));
    const Points c = state.q + system.noise->position_noise(state, w.col(k));
    ImplicitRoot root = solve_positions(system.kernel, c, state.p, grid.dt(), search);
    if (!root.found) throw StepError(k, grid, "the implicit equation (20) for the positions has no unique solution");
    path.contraction_measured = std::max(path.contraction_measured, root.contraction);
    path.continuation_steps += root.continued ? 1 : 0;
    Points p = state.p - grid.dt() * hamiltonian_q(system.kernel, root.q, state.p);
    if (!p.allFinite() || !root.q.allFinite()) throw StepError(k, grid, "the momenta grow beyond all bounds");
    path.states.push_back({std::move(root.q), std::move(p)});
  }
  return path;
}

PhaseState VariationalIntegrator::tangent(const StochasticSystem& system, const Trajectory& path,
                                          const PhaseState& initial_change, const MatrixXd& increments_change) const {
  const double dt = path.grid.dt();
  const MatrixXd dw = acting_increments(increments_change);
  PhaseState delta = initial_change;
  for (int k = 0; k < path.grid.steps; ++k) {
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    const Points& q = path.states[static_cast<std::size_t>(k) + 1].q;
    const Points change =
        delta.q + system.noise->position_noise(state, dw.col(k)) + dt * system.kernel.apply(q, q, delta.p);
    delta.q = solve_tangent(system.kernel, q, state.p, dt, change);
    delta.p -= dt * (system.kernel.hessian(q, state.p, delta.q) + system.kernel.gradient(q, delta.p, state.p));
  }
  return delta;
}

// Each step read backwards: with A, H_qq and K at (q⁺, p),
//   q̄⁺ ← q̄⁺ − Δt H_qq p̄⁺,  (I − ΔtA)ᵀ μ = q̄⁺,  p̄ = p̄⁺ − Δt A p̄⁺ + Δt K μ,  q̄ = μ,  w̄ = (h_p)ᵀ μ.
PathGradient VariationalIntegrator::adjoint(const StochasticSystem& system, const Trajectory& path,
                                            const PhaseState& final_bar) const {
  const double dt = path.grid.dt();
  const PhaseState& start = path.initial();
  const int channels = system.noise->channels(static_cast<int>(start.q.rows()), static_cast<int>(start.q.cols()));
  MatrixXd w_bar(channels, path.grid.steps);
  PhaseState bar = final_bar;
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    const Points& q = path.states[static_cast<std::size_t>(k) + 1].q;
    bar.q -= dt * system.kernel.hessian(q, state.p, bar.p);
    bar.p -= dt * system.kernel.apply_tangent(q, state.p, bar.p);
    bar.q = solve_tangent_transposed(system.kernel, q, state.p, dt, bar.q);
    bar.p += dt * system.kernel.apply(q, q, bar.q);
    w_bar.col(k) = system.noise->position_noise_transposed(state, bar.q);
  }
  return {std::move(bar.q), std::move(bar.p), acting_increments_transposed(w_bar)};
}

EndpointJacobian VariationalIntegrator::endpoint_jacobian(const StochasticSystem& system,
                                                          const Trajectory& path) const {
  const double dt = path.grid.dt();
  const PhaseState& start = path.initial();
  const Index d = start.q.rows();
  const Index rows = start.q.size();
  const Index channels = system.noise->channels(static_cast<int>(d), static_cast<int>(start.q.cols()));
  EndpointJacobian jacobian{{}, MatrixXd(rows, channels * path.grid.steps)};
  MatrixXd acting(rows, channels * path.grid.steps);
  MatrixXd q_bar = MatrixXd::Identity(rows, rows);  // column r: the adjoint state for coordinate r of q(T)
  MatrixXd p_bar = MatrixXd::Zero(rows, rows);
  for (int k = path.grid.steps - 1; k >= 0; --k) {
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    const Points& q = path.states[static_cast<std::size_t>(k) + 1].q;
    const MatrixXd tangent = dt * system.kernel.tangent_matrix(q, state.p);
    q_bar.noalias() -= dt * system.kernel.hessian_matrix(q, state.p) * p_bar;
    p_bar -= (tangent * p_bar).eval();
    q_bar = (MatrixXd::Identity(rows, rows) - tangent.transpose()).partialPivLu().solve(q_bar).eval();
    p_bar.noalias() += dt * velocity_matrix(system.kernel, q) * q_bar;
    for (Index r = 0; channels > 0 && r < rows; ++r)
      acting.block(r, k * channels, 1, channels) =
          system.noise->position_noise_transposed(state, q_bar.col(r).reshaped(d, start.q.cols())).transpose();
  }
  for (int k = 0; k < path.grid.steps; ++k) {
    auto block = jacobian.increments.middleCols(k * channels, channels);
    block = 0.5 * acting.middleCols(k * channels, channels);
    if (k + 1 < path.grid.steps) block += 0.5 * acting.middleCols((k + 1) * channels, channels);
  }
  jacobian.momenta = p_bar.transpose();
  return jacobian;
}

}  // namespace pulson
