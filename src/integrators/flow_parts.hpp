#pragma once

#include "implicit_step.hpp"

namespace pulson {

/// The flow of (20) over a time Δt, with the friction λ of the noise and with G = 0 unless it compensates:
///
///     q⁺ = q + Δt (H + G)_p(q⁺,p)                       implicit in q⁺
///     p⁺ = p − Δt (H + G)_q(q⁺,p) − λΔt H_p(q⁺,p)
///
/// Its derivatives are given at `at` = (q⁺, p).
class FlowPart {
 public:
  FlowPart(const StochasticSystem& system, double dt, bool compensates)
      : system_(system), dt_(dt), compensates_(compensates) {}

  /// q⁺
  ImplicitRoot positions(const PhaseState& start, RootSearch search) const;

  /// p⁺
  Points momenta(const PhaseState& at) const;

  /// @param parameters of the noise, their change; empty for none
  PhaseState tangent(const PhaseState& at, const PhaseState& change, const Eigen::VectorXd& parameters) const;

  /// The transpose; adds the derivative by the parameters of the noise.
  PhaseState adjoint(const PhaseState& at, const PhaseState& end_bar, Eigen::VectorXd& parameters_bar) const;

 private:
  const StochasticSystem& system_;
  double dt_;
  bool compensates_;
};

/// The adjoint method of FlowPart (the inverse of its step over −Δt), with G = 0:
///
///     p' = p − Δt H_q(q,p') − λΔt H_p(q,p')             implicit in p'
///     q' = q + Δt H_p(q,p')
///
/// Its derivatives are given at `at` = (q, p').
class AdjointFlowPart {
 public:
  AdjointFlowPart(const StochasticSystem& system, double dt) : system_(system), dt_(dt) {}

  /// p'
  ImplicitRoot momenta(const PhaseState& start, RootSearch search) const;

  /// q'
  Points positions(const PhaseState& at) const;

  PhaseState tangent(const PhaseState& at, const PhaseState& change, const Eigen::VectorXd& parameters) const;
  PhaseState adjoint(const PhaseState& at, const PhaseState& end_bar, Eigen::VectorXd& parameters_bar) const;

 private:
  const StochasticSystem& system_;
  double dt_;
};

}  // namespace pulson
