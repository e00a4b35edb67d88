#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The stochastic variational integrator (20) of Holm and Tyranowski, as printed or compensated. In the adapted state
/// (q, p̂), with w_k = ½(ΔW_{k−1} + ΔW_k), ΔW_{−1} = ΔW_K = 0 as the variation of the finite sums in (19) gives, one
/// step is
///
///     p + Σ h_i,q(q,p) w_k = p̂                      linear in p
///     q⁺ = q + Σ h_i,p(q,p) w_k + Δt (H + G)_p(q⁺,p)    implicit in q⁺
///     p̂⁺ = p − Δt (H + G)_q(q⁺,p) − λΔt H_p(q⁺,p)
///
/// p is the pᵏ of (20), which already holds half of the coming increment: p̂⁺ = p⁺ + Σ h_i,q(q⁺,p⁺) w_{k+1} there.
/// `variational-paper` has G = 0. It converges to the Stratonovich equation of H − ¼ Σ h_i,q·h_i,p, which is (11) only
/// where h_i,q·h_i,p = 0. `variational` has G = ¼ Σ h_i,q·h_i,p and converges to (11) for every noise model; where G
/// vanishes the two are the same.
///
/// A composition of canonical maps for frozen increments: symplectic in (q, p̂), and exact in the total momentum,
/// because its equations are solved to round-off (but for friction λ, which Langevin's noise has). Strong order ½, weak
/// order 1, order 1 without noise.
///
/// The roots p and q⁺ are those continuously connected to w = 0 and Δt = 0. On that branch landmarks never meet in a
/// step of the flow only (G = 0), as two equal columns of q⁺ would need two equal columns of the right-hand side, so
/// order on a line changes only by the noise, for any Δt.
class VariationalIntegrator final : public Integrator {
 public:
  explicit VariationalIntegrator(bool compensated) : compensated_(compensated) {}

  std::string name() const override { return compensated_ ? "variational" : "variational-paper"; }
  IntegratorTraits traits() const override { return {}; }

  /// Cost O(K (dN)³), memory O((dN)² + dN·CK).
  EndpointJacobian endpoint_jacobian(const StochasticSystem& system, const Trajectory& path) const override;

  /// Landmarks without momentum and without a change of it are passive: for M others, cost
  /// O(K ((dM)³ + (dM)²R + dN dM R)), memory O(dN R), if noise does not move the momenta; else a tangent for each.
  Eigen::MatrixXd endpoint_changes(const StochasticSystem& system, const Trajectory& path,
                                   const Eigen::MatrixXd& momentum_changes) const override;

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;
  Eigen::MatrixXd acting(const Eigen::MatrixXd& increments) const override { return acting_increments(increments); }
  Eigen::MatrixXd acting_transposed(const Eigen::MatrixXd& acting_bar) const override {
    return acting_increments_transposed(acting_bar);
  }

 private:
  bool compensates(const NoiseModel& noise) const { return compensated_ && noise.traits().compensated; }

  bool compensated_;
};

}  // namespace pulson
