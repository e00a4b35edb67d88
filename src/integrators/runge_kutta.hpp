#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// An explicit Runge–Kutta scheme: k_i = F(z + Σ_{j<i} a_ij k_j), z⁺ = z + Σ_i b_i k_i, where F adds up what a step of
/// (11) does, noise increments as they are. Not symplectic.
struct ExplicitTableau {
  std::string name;
  Eigen::MatrixXd a;  ///< strictly lower triangular
  Eigen::VectorXd b;
  int order;
  bool noise;
};

/// z* = z + F(z), z⁺ = z + ½(F(z) + F(z*)): converges to the Stratonovich equation, strong order 1 for one channel or
/// additive noise and ½ else, weak order 1, order 2 without noise.
ExplicitTableau heun_tableau();

/// The classical scheme of order 4, for no noise.
ExplicitTableau rk4_tableau();

class RungeKuttaIntegrator final : public Integrator {
 public:
  explicit RungeKuttaIntegrator(ExplicitTableau tableau) : tableau_(std::move(tableau)) {}

  std::string name() const override { return tableau_.name; }
  IntegratorTraits traits() const override {
    return {.symplectic = false, .noise = tableau_.noise, .order = tableau_.order};
  }

 protected:
  StepOutcome do_step(const StochasticSystem& system, const PhaseState& start, double dt, const Eigen::VectorXd& w,
                      RootSearch search) const override;
  PhaseState do_tangent(const Step& step, const PhaseState& start_change, const Eigen::VectorXd& w_change,
                        const Eigen::VectorXd& parameters_change) const override;
  StepBar do_adjoint(const Step& step, const PhaseState& end_bar) const override;
  SpaceStep do_space(const Step& step) const override;

 private:
  ExplicitTableau tableau_;
};

}  // namespace pulson
