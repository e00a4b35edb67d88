#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The stochastic variational integrator (20) of Holm and Tyranowski, for k = 0..K−1 with w_k = ½(ΔW_{k−1} + ΔW_k):
///
///     q⁺ = q + Δt K(q⁺)p + Σ_i h_i,p w_k        implicit in q⁺
///     p⁺ = p − Δt H_q(q⁺,p)
///
/// for noise with constant h_p and h_q = 0, where the adapted momentum equals p. ΔW_{−1} = ΔW_K = 0, as the variation
/// of the finite sums in (19) gives. Symplectic and exact in the total momentum, because q⁺ is solved to round-off;
/// strong order ½, weak order 1, order 1 without noise.
///
/// The root q⁺ is the one that is continuously connected to Δt → 0. On that branch landmarks never meet, as two equal
/// columns of q⁺ would need two equal columns of the right-hand side, so order on a line is kept whatever Δt; see
/// solve_positions().
class VariationalIntegrator final : public Integrator {
 public:
  std::string name() const override { return "variational"; }
  Trajectory integrate(const StochasticSystem& system, const PhaseState& initial, const TimeGrid& grid,
                       const Eigen::MatrixXd& increments, RootSearch search = RootSearch::kThorough) const override;
  PhaseState tangent(const StochasticSystem& system, const Trajectory& path, const PhaseState& initial_change,
                     const Eigen::MatrixXd& increments_change) const override;
  PathGradient adjoint(const StochasticSystem& system, const Trajectory& path,
                       const PhaseState& final_bar) const override;
  EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const override;
};

}  // namespace pulson
