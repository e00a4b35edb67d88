#pragma once

#include "implicit_step.hpp"

namespace pulson {

/// F(q) = Δt (H + G)_p(q, p): the implicit map of the positions.
class PositionMap final : public ImplicitMap {
 public:
  PositionMap(const StochasticSystem& system, const Points& p, double dt, bool compensates)
      : system_(system), p_(p), dt_(dt), compensates_(compensates) {}

  Points value(const Points& q) const override;
  Eigen::MatrixXd jacobian(const Points& q) const override;
  Eigen::VectorXd rounding_scale() const override;
  /// No two landmarks, one of them with momentum, may turn about each other by more than a right angle: an iteration
  /// that overshoots can land on a root where two of them have passed each other; on the branch from Δt = 0 they
  /// cannot.
  bool on_same_branch(const Points& before, const Points& after) const override;

  /// F'(q) δ and F'(q)ᵀ μ.
  Points tangent(const Points& q, const Points& delta) const;
  Points transposed(const Points& q, const Points& mu) const;

 private:
  const StochasticSystem& system_;
  const Points& p_;
  double dt_;
  bool compensates_;
};

/// F(p) = −Δt H_q(q, p) − λΔt H_p(q, p): the implicit map of the momenta in the adjoint of (20).
class KickMap final : public ImplicitMap {
 public:
  /// @param momenta that bound the terms of F
  KickMap(const StochasticSystem& system, const Points& q, const Points& momenta, double dt)
      : system_(system), q_(q), momenta_(momenta), dt_(dt) {}

  Points value(const Points& p) const override;
  Eigen::MatrixXd jacobian(const Points& p) const override;
  Eigen::VectorXd rounding_scale() const override;
  double contraction() const override { return 0.5; }

  /// F'(p) δ and F'(p)ᵀ μ.
  Points tangent(const Points& p, const Points& delta) const;
  Points transposed(const Points& p, const Points& mu) const;

 private:
  double friction() const { return system_.noise->friction(); }

  const StochasticSystem& system_;
  const Points& q_;
  const Points& momenta_;
  double dt_;
};

/// F(p) = −Σ h_i,q(q, p) w: the affine map that leads from the adapted momentum to p.
class MomentumMap final : public ImplicitMap {
 public:
  MomentumMap(const NoiseModel& noise, const Points& q, const Eigen::VectorXd& w) : noise_(noise), q_(q), w_(w) {}

  Points value(const Points& p) const override { return -noise_.gradient({q_, p}, w_).q; }
  Eigen::MatrixXd jacobian(const Points& p) const override;
  Eigen::VectorXd rounding_scale() const override { return Eigen::VectorXd::Zero(1); }

 private:
  const NoiseModel& noise_;
  const Points& q_;
  const Eigen::VectorXd& w_;
};

/// K ⊗ I as a dN×dN matrix. @param gram K
Eigen::MatrixXd velocity_matrix(const Eigen::MatrixXd& gram, Eigen::Index dimension);

}  // namespace pulson
