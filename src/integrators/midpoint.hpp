#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The stochastic implicit midpoint rule: with z = (q, p), m = ½(z + z⁺) and the increments ΔW of the step,
///
///     z⁺ = z + Δt J∇H(m) + Σ_i J∇h_i(m) ΔW_i        J∇H = (H_p, −H_q)
///
/// Symplectic for frozen increments; converges to the Stratonovich equation (11), with strong order 1 for one channel
/// or additive noise and ½ else, weak order 1, order 2 without noise, and then reversible. m is the root that is
/// continuously connected to Δt = 0 and ΔW = 0. (Milstein, Repin, Tretyakov, SIAM J. Numer. Anal. 39, 2002, who
/// truncate ΔW so that m always exists; here a step without such an m is an error.)
class MidpointIntegrator final : public Integrator {
 public:
  std::string name() const override { return "midpoint"; }
  IntegratorTraits traits() const override { return {.reversible = true, .order = 2}; }

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;
};

}  // namespace pulson
