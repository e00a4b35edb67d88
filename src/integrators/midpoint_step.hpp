#pragma once

#include "implicit_step.hpp"
#include "step_field.hpp"

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

}  // namespace pulson
