#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// A symmetric composition of the variational integrator (20) and its adjoint method, with the noise of the step
/// between them. With h = ½Δt, the increments ΔW of the step and h_w = Σ h_i ΔW_i, one step is
///
///     p' = p − h H_q(q,p') − λh H_p(q,p'),     q' = q + h H_p(q,p')             implicit in p'
///     (q'',p'') = the flow of h_w over time 1 from (q',p')
///     q⁺ = q'' + h H_p(q⁺,p''),     p⁺ = p'' − h H_q(q⁺,p'') − λh H_p(q⁺,p'')   implicit in q⁺
///
/// The flow of h_w is exact where ∇h_w is constant, or depends only on q and moves only momenta; else it is the
/// implicit midpoint rule. Each part is canonical for frozen increments, so the step is symplectic in (q, p) (but for
/// friction λ, which Langevin's noise has) and exact in the total momentum. It converges to the Stratonovich equation
/// (11) without compensation.
///
/// `variational-2`. Without noise reversible and of order 2. Strong order 1 for one channel or commuting ones, ½ else.
/// Weak order 2 where the flow of h_w is exact, 1 else. As many implicit solves as two steps of (20); where h_w is
/// solved for as well, that solve takes no sums of the kernel. Noise acts within its step: nothing is left to the next.
///
/// `stormer-verlet` is the same, for no noise: the Störmer–Verlet scheme for a Hamiltonian that does not separate
/// (Hairer, Lubich, Wanner, Geometric Numerical Integration, VI (3.4)).
///
/// Roots are those continuously connected to Δt = 0 and ΔW = 0.
class SymmetricVariationalIntegrator final : public Integrator {
 public:
  explicit SymmetricVariationalIntegrator(bool noise) : noise_(noise) {}

  std::string name() const override { return noise_ ? "variational-2" : "stormer-verlet"; }
  IntegratorTraits traits() const override { return {.reversible = true, .noise = noise_, .order = 2}; }

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

 private:
  /// Where the derivatives of the three parts are taken: (q, p'), the midpoint of the noise (empty without noise) and
  /// (q⁺, p''). `Trajectory::stage_momenta` holds p'; the noise is solved for again.
  struct Parts {
    PhaseState first;
    PhaseState noise;
    PhaseState second;
  };
  static Parts parts_of(const Step& step);

  bool noise_;
};

}  // namespace pulson
