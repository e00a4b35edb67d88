#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// The Störmer–Verlet scheme for a Hamiltonian that does not separate, without noise:
///
///     p½ = p − ½Δt H_q(q, p½)                          implicit in p½
///     q⁺ = q + ½Δt (H_p(q, p½) + H_p(q⁺, p½))          implicit in q⁺
///     p⁺ = p½ − ½Δt H_q(q⁺, p½)
///
/// Symplectic, reversible, of order 2 (Hairer, Lubich, Wanner, Geometric Numerical Integration, VI (3.4)). Roots are
/// those continuously connected to Δt = 0.
class StormerVerletIntegrator final : public Integrator {
 public:
  std::string name() const override { return "stormer-verlet"; }
  IntegratorTraits traits() const override { return {.reversible = true, .noise = false, .order = 2}; }

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;
};

}  // namespace pulson
