#pragma once

#include "pulson/integrators/integrator.hpp"

namespace pulson {

PhaseState operator+(const PhaseState& a, const PhaseState& b);
PhaseState operator*(double factor, const PhaseState& a);

/// What one step of (11) adds up: F(z) = Δt (H_p, −H_q − λH_p) + (h_w,p, −h_w,q) at z = (q, p), w the increments, with
/// its derivatives. With Δt = 0 it is the noise alone and takes no sums of the kernel.
class StepField {
 public:
  StepField(const StochasticSystem& system, double dt, const Eigen::VectorXd& w) : system_(system), dt_(dt), w_(w) {}

  PhaseState value(const PhaseState& z) const;

  /// F'(z) δ
  PhaseState tangent(const PhaseState& z, const PhaseState& delta) const;

  /// F'(z)ᵀ μ
  PhaseState transposed(const PhaseState& z, const PhaseState& mu) const;

  /// The change of F(z) with w and with the parameters of the noise (which may be empty: none).
  PhaseState forced(const PhaseState& z, const Eigen::VectorXd& w_change, const Eigen::VectorXd& parameters) const;

  /// The transpose of `forced`, added.
  void add_forced_transposed(const PhaseState& z, const PhaseState& mu, Eigen::VectorXd& w_bar,
                             Eigen::VectorXd& parameters_bar) const;

 private:
  bool has_noise() const { return w_.size() > 0; }

  const StochasticSystem& system_;
  double dt_;
  const Eigen::VectorXd& w_;
};

}  // namespace pulson
