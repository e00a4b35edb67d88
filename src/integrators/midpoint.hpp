#pragma once

#include "implicit_step.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The implicit midpoint rule z⁺ = z + F(m), m = ½(z + z⁺), for what a step adds up. Its derivatives are given at m.
class MidpointStep {
 public:
  /// @param dt 0 for the noise alone
  MidpointStep(const StochasticSystem& system, double dt, const Eigen::VectorXd& w)
      : system_(system), field_(system, dt, w), dt_(dt) {}

  struct Outcome {
    PhaseState middle;
    PhaseState end;
    bool found = true;
    bool continued = false;
    double contraction = 0;
  };
  Outcome take(const PhaseState& start, RootSearch search) const;

  /// @param w_change, parameters what changes in F; parameters may be empty for none
  PhaseState tangent(const PhaseState& middle, const PhaseState& change, const Eigen::VectorXd& w_change,
                     const Eigen::VectorXd& parameters) const;

  /// The transpose; adds the derivatives by w and the parameters of the noise.
  PhaseState adjoint(const PhaseState& middle, const PhaseState& end_bar, Eigen::VectorXd& w_bar,
                     Eigen::VectorXd& parameters_bar) const;

 private:
  const StochasticSystem& system_;
  StepField field_;
  double dt_;
};

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
